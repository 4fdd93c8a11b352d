// What opening a device has found: parts that cannot be used cost themselves, and not the device.
#include "drivers/api/device.h"

#include <algorithm>

namespace lensd::drivers {
namespace {

/// The device may do tomorrow what it refused today.
bool MayPass(Code code) {
  return code == Code::Timeout || code == Code::Busy || code == Code::Protocol || code == Code::Io;
}

class NoAxes final : public Lens {
 public:
  NoAxes(Capabilities who, const Clock& clock) : Lens(std::move(who)), clock_(clock) {}

 private:
  // Lens refuses an axis that is not there before any of these is called.
  Result<void> DoStartHome(Axis) override { return Fail(Code::Internal, "there is no axis"); }
  Result<void> DoStartMove(Axis, Native) override { return Fail(Code::Internal, "there is no axis"); }
  Result<void> DoStop(Axis) override { return Fail(Code::Internal, "there is no axis"); }
  Result<LensState> DoRead() override {
    LensState state;
    state.sampled_at = clock_.Now();
    return state;
  }

  const Clock& clock_;
};

}  // namespace

void Findings::LeaveOut(std::string_view part, const Error& why) {
  if (Of(part) == nullptr) left_out_.push_back({std::string(part), why.message, why.code});
}

void Findings::TakeBack(std::string_view part) {
  std::erase_if(left_out_, [&](const LeftOut& one) { return one.part == part; });
}

void Findings::Add(const Findings& more) {
  for (const LeftOut& one : more.left_out_) LeaveOut(one.part, {one.code, one.reason});
  doubts_.insert(doubts_.end(), more.doubts_.begin(), more.doubts_.end());
}

bool Findings::may_pass() const {
  return std::ranges::any_of(left_out_, [](const LeftOut& one) { return MayPass(one.code); });
}

const LeftOut* Findings::Of(std::string_view part) const {
  const auto found = std::ranges::find(left_out_, part, &LeftOut::part);
  return found == left_out_.end() ? nullptr : &*found;
}

Error Findings::NothingLeft(const std::string& device) const {
  Error error{Code::Unsupported, device + " has nothing that can be used"};
  for (const LeftOut& one : left_out_) {
    error.message += (&one == &left_out_.front() ? ": " : "; ") + one.part + " (" + one.reason + ")";
    if (error.code == Code::Unsupported && MayPass(one.code)) error.code = one.code;
  }
  return error;
}

std::unique_ptr<Lens> LensWithoutAxes(Capabilities who, const Clock& clock) {
  return std::make_unique<NoAxes>(std::move(who), clock);
}

}  // namespace lensd::drivers
