// Backlash is how much lower sweeps from above find the focus than sweeps from below: pairs of sweeps with fits of
// their peaks, after a coarse look at where they are.
#include "rig/backlash.h"

#include <math.h>  // Boost 1.74

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <deque>
#include <memory>
#include <utility>

#include "autofocus/measures.h"
#include "autofocus/peak_fit.h"
#include "autofocus/session.h"
#include "autofocus/sharpness.h"
#include "rig/procedures/command_guard.h"

namespace lensd::rig {
namespace {

using drivers::Axis;

constexpr double kMostBacklash = 0.1;  ///< of the focus range
constexpr int kPoints = 17;            ///< of a fine sweep
constexpr double kHalfWidth_px = 4.0;  ///< of blur, from the focus to either end of a fine sweep
constexpr double kNarrow = 0.004;      ///< of the range: the same where the optics are not known
constexpr double kClearFall = 0.6;     ///< sharpness at the ends of a sweep over that at its top, at most
constexpr int kMostWidenings = 5;
constexpr double kLeastScatter = 0.25;  ///< steps: agreement beyond that is chance

/// One pass over the focus in one direction.
struct Sweep {
  std::deque<double> ahead;  ///< positions still to come; the first is only for the run-up
  bool running_up = true;
  std::vector<double> positions;
  std::vector<autofocus::FocusScore> scores;
};

class BacklashRun : public std::enable_shared_from_this<BacklashRun> {
 public:
  using Done = std::move_only_function<void(Result<BacklashOutcome>)>;
  BacklashRun(Rig& rig, const BacklashRequest& request, std::function<void(const BacklashProgress&)> progress,
              Done done)
      : rig_(rig),
        guard_(rig),
        activity_(rig.Occupy({.kind = Activity::Kind::Backlash, .step = 0, .of = 0})),
        request_(request),
        progress_(std::move(progress)),
        done_(std::move(done)),
        began_at_(rig.clock().Now()) {}

  void Begin();

 private:
  enum class Stage { Upward, Coarse, PairUp, PairDown };
  struct Range {
    double lowest = 0.0, highest = 0.0, resolution = 1.0;
  };
  /// Of the focus.
  struct Place {
    double home = 0.0;            ///< where autofocus left the lens
    double upward = 0.0;          ///< where sweeps from below find it
    double backlash = 0.0;        ///< so far: sweeps from above find it so much lower
    double half_width = 0.0;      ///< of a sweep around it
    std::vector<double> found{};  ///< by each pair of sweeps
  };
  struct Counts {
    int widenings = 0, sweeps = 0, frames = 0;
  };

  void OnFocused(const Result<AutofocusOutcome>& focused);
  void BeginSweep(double from, double to, double step);
  void Next();
  void TakeFrame();
  void OnFrame(const Result<LensedFrame>& taken);
  void FinishSweep();
  void FinishUpward(const std::optional<autofocus::PeakFit>& peak);
  void FinishCoarse();
  void FinishPair(const std::optional<autofocus::PeakFit>& peak);
  void StartPair();
  std::vector<autofocus::CurvePoint> Points() const;
  std::optional<autofocus::PeakFit> Peak() const;
  void Conclude();
  void Refuse(BacklashCause cause, std::string reason);
  void GoBack(Result<BacklashOutcome> answer);
  double run_up() const { return kMostBacklash * (range_.highest - range_.lowest); }

  Rig& rig_;
  CommandGuard guard_;
  const std::shared_ptr<Activity> activity_;
  BacklashRequest request_;
  std::function<void(const BacklashProgress&)> progress_;
  Done done_;
  const Instant began_at_;
  Range range_;
  Place place_;
  Stage stage_ = Stage::Upward;
  Sweep sweep_;
  Counts counts_;
};

void BacklashRun::Begin() {
  const auto [low, high] = rig_.SoftLimits(Axis::Focus);
  range_ = {low.value, high.value, rig_.lens().axes[Axis::Focus]->resolution};
  AutofocusRequest focus;
  if (request_.region) focus.regions = {*request_.region};
  guard_.Autofocus(focus, [self = shared_from_this()](Result<AutofocusOutcome> focused) { self->OnFocused(focused); });
}

void BacklashRun::OnFocused(const Result<AutofocusOutcome>& focused) {
  if (!focused) return done_(PassOn(focused));
  counts_.frames += focused->frames;
  place_.home = place_.upward = focused->position.value;
  if (!focused->focused) return Refuse(BacklashCause::NotFocused, "there is nothing to focus on: " + focused->reason);
  place_.half_width = kNarrow * (range_.highest - range_.lowest);
  const Status status = rig_.GetStatus();
  const double pixel_m = rig_.camera()->pixel_um * 1e-6;
  if (status.optics && status.optics->has_focus() && status.f_number && pixel_m > 0.0) {
    const Native here{place_.home}, beside{place_.home + range_.resolution};
    const double slope = (status.optics->ExtensionFromNative(beside) - status.optics->ExtensionFromNative(here)).value;
    place_.half_width = kHalfWidth_px * pixel_m * status.f_number->value / std::abs(slope / range_.resolution);
  }
  place_.half_width = std::max(place_.half_width, 0.5 * (kPoints - 1) * range_.resolution);
  stage_ = Stage::Upward;
  BeginSweep(place_.upward - place_.half_width, place_.upward + place_.half_width,
             2.0 * place_.half_width / (kPoints - 1));
}

/// From `from` to `to`, reached from so far before it that all backlash is taken up.
void BacklashRun::BeginSweep(double from, double to, double step) {
  activity_->step = ++counts_.sweeps;
  activity_->of = std::max(counts_.sweeps, 2 + 2 * request_.pairs);
  if (progress_) progress_({counts_.sweeps, activity_->of, counts_.frames});
  sweep_ = {};
  const double sign = to > from ? 1.0 : -1.0;
  const int count = static_cast<int>(std::floor(std::abs(to - from) / step + 1e-6)) + 1;
  sweep_.ahead.push_back(std::clamp(from - sign * run_up(), range_.lowest, range_.highest));
  for (int i = 0; i < count; ++i) {
    const double at = std::round((from + sign * step * i) / range_.resolution) * range_.resolution;
    if (at >= range_.lowest && at <= range_.highest && (sweep_.ahead.size() == 1 || at != sweep_.ahead.back())) {
      sweep_.ahead.push_back(at);
    }
  }
  Next();
}

void BacklashRun::Next() {
  if (sweep_.ahead.empty()) return FinishSweep();
  const double to = sweep_.ahead.front();
  sweep_.ahead.pop_front();
  guard_.Move(Axis::Focus, {.kind = Target::Kind::Native, .value = to, .from = {}, .take_up = 0.0},
              [self = shared_from_this()](Result<MoveOutcome> moved) {
                if (!moved) return self->done_(PassOn(moved));
                if (!moved->reached)
                  return self->Refuse(BacklashCause::Missed, "the lens did not reach its target: " + moved->reason);
                if (std::exchange(self->sweep_.running_up, false)) return self->Next();
                self->TakeFrame();
              });
}

void BacklashRun::TakeFrame() {
  guard_.Snapshot([self = shared_from_this()](Result<LensedFrame> taken) { self->OnFrame(taken); });
}

void BacklashRun::OnFrame(const Result<LensedFrame>& taken) {
  if (!taken) return done_(PassOn(taken));
  const auto& focus = taken->axes[Axis::Focus];
  const auto& camera = *rig_.camera();
  const auto window = autofocus::WindowOf(request_.region.value_or(camera.focus_region), camera.width, camera.height);
  if (!window) return done_(PassOn(window));
  const auto score = autofocus::ScoreFocus(taken->frame, *window);
  if (!score) return done_(PassOn(score));
  ++counts_.frames;
  sweep_.positions.push_back(0.5 * (focus->lowest + focus->highest).value);
  sweep_.scores.push_back(*score);
  Next();
}

std::vector<autofocus::CurvePoint> BacklashRun::Points() const {
  const auto& camera = *rig_.camera();
  const auto window = autofocus::WindowOf(request_.region.value_or(camera.focus_region), camera.width, camera.height);
  const double noise = autofocus::NoiseVariance(sweep_.scores, camera.bits);
  std::vector<autofocus::CurvePoint> points;
  for (std::size_t i = 0; i < sweep_.scores.size(); ++i) {
    const auto sharpness = autofocus::SharpnessOf(sweep_.scores[i], noise, window->width * window->height);
    points.push_back({sweep_.positions[i], sharpness.value, sharpness.sigma});
  }
  return points;
}

/// Where the sweep is sharpest; nothing where it does not clearly rise and fall.
std::optional<autofocus::PeakFit> BacklashRun::Peak() const {
  auto points = Points();
  if (points.size() < 5) return std::nullopt;
  const auto top = std::ranges::max_element(points, {}, &autofocus::CurvePoint::value);
  const double fall = kClearFall * top->value;
  if (points.front().value > fall || points.back().value > fall) return std::nullopt;
  // The far slopes of a peak are no parabola.
  const double least = 0.25 * top->value;
  std::erase_if(points, [&](const auto& point) { return point.value < least; });
  const auto peak = autofocus::FitPeak(points);
  const auto [low, high] = std::ranges::minmax(sweep_.positions);
  if (!peak || peak->position < low || peak->position > high) return std::nullopt;
  return peak;
}

void BacklashRun::FinishSweep() {
  switch (stage_) {
    case Stage::Upward:
      return FinishUpward(Peak());
    case Stage::Coarse:
      return FinishCoarse();
    case Stage::PairUp:
    case Stage::PairDown:
      return FinishPair(Peak());
  }
}

/// Wider, or about where it was sharpest, until the sweep holds a whole peak.
void BacklashRun::FinishUpward(const std::optional<autofocus::PeakFit>& peak) {
  if (!peak) {
    if (++counts_.widenings > kMostWidenings)
      return Refuse(BacklashCause::NoPeak, "the sharpness has no clear peak: more texture or light is needed");
    const auto points = Points();
    if (!points.empty()) place_.upward = std::ranges::max_element(points, {}, &autofocus::CurvePoint::value)->position;
    place_.half_width = std::min(1.5 * place_.half_width, 0.25 * (range_.highest - range_.lowest));
  } else {
    place_.upward = peak->position;
    stage_ = Stage::Coarse;
    const double step = std::max(0.5 * place_.half_width, range_.resolution);
    return BeginSweep(place_.upward + place_.half_width, place_.upward - place_.half_width - run_up(), step);
  }
  BeginSweep(place_.upward - place_.half_width, place_.upward + place_.half_width,
             2.0 * place_.half_width / (kPoints - 1));
}

void BacklashRun::FinishCoarse() {
  const auto points = Points();
  if (points.empty()) return Refuse(BacklashCause::NoRoom, "the soft limits leave no room to come from above");
  const auto top = std::ranges::max_element(points, {}, &autofocus::CurvePoint::value);
  if (top == points.end() - 1) {
    return Refuse(BacklashCause::TooLarge,
                  "coming from above, the focus was not found within " + std::to_string(std::lround(run_up())) +
                      " steps: the backlash is larger than that, or the soft limits are too near");
  }
  place_.backlash = std::max(0.0, place_.upward - top->position);
  counts_.widenings = 0;
  StartPair();
}

void BacklashRun::StartPair() {
  stage_ = Stage::PairUp;
  BeginSweep(place_.upward - place_.half_width, place_.upward + place_.half_width,
             2.0 * place_.half_width / (kPoints - 1));
}

/// The first pair only says where to look: later pairs see the peak from the same positions relative to it, so that
/// what the fit makes of its shape cancels.
void BacklashRun::FinishPair(const std::optional<autofocus::PeakFit>& peak) {
  if (!peak) {
    if (++counts_.widenings > kMostWidenings)
      return Refuse(BacklashCause::NoPeak, "the sharpness has no clear peak in one of the sweeps");
    const auto points = Points();
    const auto top = std::ranges::max_element(points, {}, &autofocus::CurvePoint::value);
    if (points.empty()) return Refuse(BacklashCause::NoRoom, "the soft limits leave no room for the sweeps");
    stage_ == Stage::PairDown ? place_.backlash = std::max(0.0, place_.upward - top->position)
                              : place_.upward = top->position;
    place_.half_width =
        std::min(1.25 * place_.half_width, 0.25 * (range_.highest - range_.lowest));  // the whole peak, with its feet
    return StartPair();
  }
  const double step = 2.0 * place_.half_width / (kPoints - 1);
  if (stage_ == Stage::PairUp) {
    place_.upward = peak->position;
    stage_ = Stage::PairDown;
    return BeginSweep(place_.upward - place_.backlash + place_.half_width,
                      place_.upward - place_.backlash - place_.half_width, step);
  }
  const double found = place_.upward - peak->position;
  const bool aligned = std::abs(found - place_.backlash) <= step;
  place_.backlash = std::max(0.0, found);
  if (aligned) {
    place_.found.push_back(found);
  } else if (++counts_.widenings > kMostWidenings) {
    return Refuse(BacklashCause::Unsteady, "the sweeps disagree about the backlash from one to the next");
  }
  static_cast<int>(place_.found.size()) < request_.pairs ? StartPair() : Conclude();
}

void BacklashRun::Conclude() {
  BacklashOutcome outcome;
  outcome.measured = true;
  outcome.backlash = BacklashFrom(place_.found, kLeastScatter * range_.resolution);
  GoBack(outcome);
}

void BacklashRun::Refuse(BacklashCause cause, std::string reason) {
  BacklashOutcome outcome;
  outcome.cause = cause;
  outcome.reason = std::move(reason);
  GoBack(outcome);
}

void BacklashRun::GoBack(Result<BacklashOutcome> answer) {
  if (answer) answer->frames = counts_.frames;
  const Target home{.kind = Target::Kind::Native, .value = place_.home, .from = {}, .take_up = run_up()};
  guard_.Move(Axis::Focus, home, [self = shared_from_this(), answer = std::move(answer)](const auto& moved) mutable {
    if (!moved) return self->done_(PassOn(moved));
    answer->elapsed = self->rig_.clock().Now() - self->began_at_;
    self->done_(std::move(answer));
  });
}

}  // namespace

Backlash BacklashFrom(const std::vector<double>& values, double sigma) {
  const auto n = static_cast<double>(values.size());
  double mean = 0.0, square = 0.0;
  for (const double value : values) mean += value / n;
  for (const double value : values) square += (value - mean) * (value - mean);
  const double scatter = std::max(std::sqrt(square / (n - 1.0)), sigma);
  const double t = boost::math::quantile(boost::math::students_t(n - 1.0), 0.975);
  const double half = t * scatter / std::sqrt(n);
  mean = std::max(mean, 0.0);
  return {.steps = mean, .low = std::max(mean - half, 0.0), .high = mean + half, .measured = true};
}

void MeasureBacklash(Rig& rig, const BacklashRequest& request, std::function<void(const BacklashProgress&)> progress,
                     std::move_only_function<void(Result<BacklashOutcome>)> done) {
  if (rig.camera() == nullptr) {
    return done(Fail(Code::Unsupported,
                     "measuring backlash needs a camera, and this lens has none; say how many steps it is instead"));
  }
  if (!rig.lens().axes[Axis::Focus]) return done(Fail(Code::Unsupported, "this lens has no motorised focus"));
  if (request.pairs < 3) return done(Fail(Code::InvalidArgument, "at least three pairs of sweeps are needed"));
  std::make_shared<BacklashRun>(rig, request, std::move(progress), std::move(done))->Begin();
}

}  // namespace lensd::rig
