#include "autofocus/session.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sweep.h"

namespace lensd::autofocus {
namespace {

constexpr int kSmallestWindow = 16;  ///< px

struct MethodRow {
  std::string_view name;
  std::unique_ptr<Method> (*make)(const Setup& setup);
};

/// Every method. "auto" is whatever is most dependable for this setup.
constexpr MethodRow kMethods[] = {
    {"sweep", [](const Setup& setup) -> std::unique_ptr<Method> { return std::make_unique<Sweep>(setup); }},
};
constexpr std::string_view kAuto = "sweep";

}  // namespace

std::vector<std::string_view> MethodNames() {
  std::vector<std::string_view> names = {"auto"};
  for (const MethodRow& row : kMethods) names.push_back(row.name);
  return names;
}

Result<Window> WindowOf(const drivers::Region& region, int width, int height) {
  const auto inside = [](double from, double size) { return from >= 0 && size > 0 && from + size <= 1 + 1e-9; };
  if (!inside(region.x, region.width) || !inside(region.y, region.height)) {
    return Fail(Code::InvalidArgument, "the region must lie inside the frame: x, y, width, height as fractions of it");
  }
  Window window;
  window.x = static_cast<int>(std::lround(region.x * width));
  window.y = static_cast<int>(std::lround(region.y * height));
  window.width = std::min(static_cast<int>(std::lround(region.width * width)), width - window.x);
  window.height = std::min(static_cast<int>(std::lround(region.height * height)), height - window.y);
  if (window.width < kSmallestWindow || window.height < kSmallestWindow) {
    return Fail(Code::InvalidArgument, "the region must cover at least " + std::to_string(kSmallestWindow) + " x " +
                                           std::to_string(kSmallestWindow) + " pixels of the frame");
  }
  return window;
}

Result<Session> Session::Create(std::string_view method, const Setup& setup) {
  const std::string_view wanted = method == "auto" ? kAuto : method;
  for (const MethodRow& row : kMethods) {
    if (row.name == wanted) return Session(row.name, row.make(setup));
  }
  std::string known;
  for (const std::string_view name : MethodNames()) known += " " + std::string(name);
  return Fail(Code::InvalidArgument, "there is no autofocus method '" + std::string(method) + "'; there are:" + known);
}

Result<Advice> Session::Next(double position, const drivers::Frame& frame, const drivers::Region& region) {
  auto window = WindowOf(region, frame.width, frame.height);
  if (!window) return PassOn(std::move(window));
  auto score = ScoreFocus(frame, *window);
  if (!score) return PassOn(std::move(score));
  bits_ = frame.bits;
  pixels_ = window->width * window->height;
  scores_.push_back(*score);
  if (to_check_) return Check();
  Advice advice = method_->Next({.position = position, .frame = &frame, .window = *window, .score = *score});
  auto* verdict = std::get_if<Verdict>(&advice);
  if (verdict == nullptr || !verdict->focused) return advice;
  to_check_ = *verdict;
  return GoAndLook{verdict->position};
}

int Session::frames_expected() const {
  return std::max(method_->FramesExpected() + 1, frames());
}

std::vector<Sharpness> Session::Sharpnesses() const {
  const double noise = NoiseVariance(scores_, bits_);
  std::vector<Sharpness> sharpness;
  for (const FocusScore& score : scores_) sharpness.push_back(SharpnessOf(score, noise, pixels_));
  return sharpness;
}

double Session::relative_sharpness() const {
  if (scores_.empty()) return 0.0;
  const auto sharpness = Sharpnesses();
  return sharpness.front().value > 0 ? sharpness.back().value / sharpness.front().value : 0.0;
}

/// The frame at the answer must be no worse than the one before the run began, and no frame of the run may be clearly
/// sharper than it.
Verdict Session::Check() const {
  constexpr double kSharpestShare = 0.8;  ///< of the sharpest frame seen: less is another place than the peak
  constexpr double kSigmas = 4.0;
  const auto sharpness = Sharpnesses();
  const Sharpness& last = sharpness.back();
  Verdict verdict = *to_check_;
  const auto refuse = [&](std::string reason) {
    verdict.focused = false;
    verdict.confidence = 0.0;
    verdict.reason = std::move(reason);
    return verdict;
  };
  const auto clearly_below = [&](const Sharpness& other, double share) {
    return last.value + kSigmas * std::hypot(last.sigma, other.sigma) < share * other.value;
  };
  if (clearly_below(sharpness.front(), 1.0)) return refuse("the check frame is less sharp than the first frame was");
  const auto sharpest = std::ranges::max_element(sharpness, {}, &Sharpness::value);
  if (clearly_below(*sharpest, kSharpestShare)) {
    return refuse("the check frame is less sharp than the search promised");
  }
  return verdict;
}

}  // namespace lensd::autofocus
