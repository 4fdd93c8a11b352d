#include "autofocus/session.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "defocus/defocus.h"
#include "moving.h"
#include "searches.h"
#include "sweep.h"

namespace lensd::autofocus {
namespace {

constexpr int kSmallestWindow = 16;  ///< px

struct MethodRow {
  std::string_view name;
  bool needs_optics;      ///< pictures, and what a step does to their blur
  bool looks_on_the_way;  ///< only when asked for by name
  std::unique_ptr<Method> (*make)(const Setup& setup);
};

template <class Made>
std::unique_ptr<Method> Make(const Setup& setup) {
  return std::make_unique<Made>(setup);
}

/// What "auto" tries, in this order, as far as the lens allows.
constexpr MethodRow kMethods[] = {
    {"defocus", true, false, Make<Defocus>},
    {"sweep", false, false, Make<Sweep>},
    {"moving", false, true, Make<Moving>},
};

/// `name` is one of MethodNames() other than "auto".
std::unique_ptr<Method> MakeMethod(std::string_view name, const Setup& setup) {
  const auto row = std::ranges::find(kMethods, name, &MethodRow::name);
  if (row != std::end(kMethods)) return row->make(setup);
  return MakeSearch(*std::ranges::find(Searches(), name, &Search::name), setup);
}

}  // namespace

std::vector<std::string_view> MethodNames() {
  std::vector<std::string_view> names = {"auto"};
  for (const MethodRow& row : kMethods) names.push_back(row.name);
  for (const Search& search : Searches()) names.push_back(search.name);
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
  std::vector<std::string_view> names;
  if (method == "auto") {
    for (const MethodRow& row : kMethods) {
      if (((setup.blur_px && setup.pictures) || !row.needs_optics) && !row.looks_on_the_way) names.push_back(row.name);
    }
  } else {
    const auto* row = std::ranges::find(kMethods, method, &MethodRow::name);
    if (row != std::end(kMethods) && row->needs_optics && !setup.pictures) {
      return Fail(Code::InvalidArgument,
                  "the method '" + std::string(method) + "' needs pictures, not their sharpness");
    }
    if (row != std::end(kMethods) && row->looks_on_the_way && !setup.stride) {
      return Fail(Code::Unsupported,
                  "the method '" + std::string(method) + "' looks while the lens moves: " + setup.no_stride);
    }
    const auto all = MethodNames();
    if (const auto found = std::ranges::find(all, method); found != all.end()) names.push_back(*found);
  }
  if (!names.empty()) return Session(setup, std::move(names));
  std::string known;
  for (const std::string_view name : MethodNames()) known += " " + std::string(name);
  return Fail(Code::InvalidArgument, "there is no autofocus method '" + std::string(method) + "'; there are:" + known);
}

Session::Session(const Setup& setup, std::vector<std::string_view> names) : setup_(setup), names_(std::move(names)) {
  StartMethod();
}

void Session::StartMethod() {
  frames_before_ = std::max(frames() - 1, 0);
  method_ = MakeMethod(names_[running_], setup_);
}

Result<Advice> Session::Next(const Place& place, const drivers::Frame& frame, const drivers::Region& region) {
  auto window = WindowOf(region, frame.width, frame.height);
  if (!window) return PassOn(std::move(window));
  auto score = ScoreFocus(frame, *window);
  if (!score) return PassOn(std::move(score));
  if (!size_) size_ = std::pair(frame.width, frame.height);
  if (*size_ != std::pair(frame.width, frame.height)) {
    return Fail(Code::InvalidArgument, "every frame of an autofocus must have the same size");
  }
  bits_ = frame.bits;
  pixels_ = window->width * window->height;
  scores_.push_back(*score);
  return Follow({.position = place.position,
                 .position_sigma = place.sigma,
                 .on_the_way = place.on_the_way,
                 .frame = &frame,
                 .window = *window,
                 .score = *score});
}

Advice Session::NextScore(double position, const Sharpness& sharpness) {
  FocusScore score;
  score.gradient_energy = sharpness.value;
  score.energy_sigma = sharpness.sigma;
  score.mean = 1.0;
  scores_.push_back(score);
  return Follow({.position = position,
                 .position_sigma = 0.0,
                 .on_the_way = false,
                 .frame = nullptr,
                 .window = {},
                 .score = score});
}

/// Of several methods the one comes first that promises an answer for the fewest frames: trying what costs f and
/// answers with chance p before what costs f' and answers with p' is the cheaper order where f/p < f'/p'.
void Session::PutInOrder(const Look& first) {
  struct Rated {
    std::string_view name;
    Forecast forecast;
  };
  std::vector<Rated> rated;
  for (const std::string_view name : names_) rated.push_back({name, MakeMethod(name, setup_)->Predict(first)});
  std::ranges::stable_sort(rated, {}, [](const Rated& one) { return one.forecast.frames / one.forecast.chance; });
  std::ostringstream text;
  for (std::size_t i = 0; i < rated.size(); ++i) {
    names_[i] = rated[i].name;
    text << (i > 0 ? ", " : "; foreseen: ") << rated[i].name << " " << std::lround(rated[i].forecast.frames)
         << " frames, " << std::lround(100.0 * rated[i].forecast.chance) << " %";
  }
  forecast_ = text.str();
  StartMethod();
}

Advice Session::Follow(const Look& look) {
  if (frames() == 1 && names_.size() > 1) PutInOrder(look);
  Advice advice = to_check_ ? Advice(Check()) : Ask(look);
  // The next method begins where the last one gave up.
  while (Refused(advice) && running_ + 1 < names_.size()) {
    to_check_.reset();
    earlier_ = std::get<Verdict>(advice);
    ++running_;
    StartMethod();
    advice = Ask(look);
  }
  if (auto* verdict = std::get_if<Verdict>(&advice); verdict != nullptr && !verdict->focused && earlier_) {
    verdict->reason += "; before that, " + std::string(names_[running_ - 1]) + ": " + earlier_->reason;
    if (verdict->candidates.empty()) verdict->candidates = earlier_->candidates;
  }
  if (auto* verdict = std::get_if<Verdict>(&advice)) verdict->reason += forecast_;
  return advice;
}

bool Session::Refused(const Advice& advice) {
  const auto* verdict = std::get_if<Verdict>(&advice);
  return verdict != nullptr && !verdict->focused && !verdict->final;
}

/// The method's advice; an answer becomes a frame at its position, unless this one is just that.
Advice Session::Ask(const Look& look) {
  Advice advice = method_->Next(look);
  const auto* verdict = std::get_if<Verdict>(&advice);
  if (verdict == nullptr || !verdict->focused) return advice;
  to_check_ = *verdict;
  if (verdict->position == look.position) return Check();
  return GoAndLook{verdict->position};
}

int Session::frames_expected() const {
  return std::max(frames_before_ + method_->FramesExpected() + 1, frames());
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

/// Something must have changed with focus, the frame at the answer must be no worse than the one before the run began,
/// and no frame of the run may be clearly sharper than it.
Verdict Session::Check() const {
  constexpr double kSharpestShare = 0.8;  ///< of the sharpest frame seen: less is another place than the peak
  constexpr double kSigmas = 4.0;
  constexpr double kClearRise = 6.0;  ///< sigmas
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
  const auto dullest = std::ranges::min_element(sharpness, {}, &Sharpness::value);
  if (last.value - dullest->value < kClearRise * std::hypot(last.sigma, dullest->sigma)) {
    return refuse("nothing in the region changes with focus: no texture, too much noise, or too little light");
  }
  if (clearly_below(sharpness.front(), 1.0)) return refuse("the check frame is less sharp than the first frame was");
  const auto sharpest = std::ranges::max_element(sharpness, {}, &Sharpness::value);
  if (clearly_below(*sharpest, kSharpestShare)) {
    return refuse("the check frame is less sharp than the search promised");
  }
  return verdict;
}

}  // namespace lensd::autofocus
