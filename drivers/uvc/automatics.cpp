// The camera's own automatics are taken over before a value is set by hand, since they would set it back, and given
// back when the device is closed.
#include "automatics.h"

#include <array>
#include <string>
#include <utility>

namespace lensd::drivers::uvc {

Result<void> Automatics::TakeFocus() {
  if (!terminal_.Has(kFocusAuto.bit)) return {};
  const std::string what = "automatic focus";
  auto now = controls_.Get(kGetCur, At(kFocusAuto), 1, what);
  if (!now) return PassOn(now);
  if ((*now)[0] == 0) return {};
  if (!focus_before_) focus_before_ = (*now)[0];
  constexpr std::array<std::uint8_t, 1> kOff = {0};
  return controls_.Set(At(kFocusAuto), kOff, what);
}

Result<void> Automatics::TakeIris() {
  iris_taken_ = true;
  return TakeMode(kAeManual | kAeAperturePriority, {kAeAperturePriority, kAeManual}, "automatic iris");
}

Result<void> Automatics::TakeExposure() {
  if (iris_taken_) return TakeMode(kAeManual, {kAeManual}, "automatic exposure");
  return TakeMode(kAeManual | kAeShutterPriority, {kAeManual, kAeShutterPriority}, "automatic exposure");
}

Result<void> Automatics::TakeMode(std::uint8_t good, std::initializer_list<std::uint8_t> modes, const char* what) {
  if (!terminal_.Has(kAeMode.bit)) return {};
  auto now = controls_.Get(kGetCur, At(kAeMode), 1, what);
  if (!now) return PassOn(now);
  if (((*now)[0] & good) != 0) return {};
  // The resolution of this bitmap is the set of modes there are.
  auto all = controls_.Get(kGetRes, At(kAeMode), 1, what);
  if (!all) return PassOn(all);
  for (const std::uint8_t mode : modes) {
    if (((*all)[0] & mode) == 0) continue;
    if (!mode_before_) mode_before_ = (*now)[0];
    return SetMode(mode);
  }
  return Fail(Code::Unsupported, std::string(what) + ": this camera cannot switch it off");
}

Result<void> Automatics::SetMode(std::uint8_t mode) {
  const std::array<std::uint8_t, 1> byte = {mode};
  return controls_.Set(At(kAeMode), byte, "automatic exposure mode");
}

void Automatics::Restore() {
  if (focus_before_) {
    const std::array<std::uint8_t, 1> byte = {*std::exchange(focus_before_, std::nullopt)};
    (void)controls_.Set(At(kFocusAuto), byte, "automatic focus");
  }
  if (mode_before_) (void)SetMode(*std::exchange(mode_before_, std::nullopt));
}

}  // namespace lensd::drivers::uvc
