// Plans again on a lens that lacks one flaw after the other. Apertures and travel that the lens has not are positions
// added to its own, as far apart and as uncertain as those at its ends.
#include "planning/plan_causes.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <utility>

#include "base/clock.h"
#include "base/quantity_text.h"
#include "optics/conjugates.h"
#include "optics/plan_causes.h"
#include "optics/planner.h"
#include "planning/zoom_choice.h"

namespace lensd::daemon {
namespace {

using drivers::Axis;
using optics::FocusPosition;
using optics::IrisPosition;
using optics::LensPositions;
using optics::PlanRequest;

/// Backlash is assumed where none is known, and no motion takes it up.
bool BacklashUnknown(const rig::Arrival& arrival) {
  return arrival.backlash > 0.0 && !arrival.overshoots;
}

/// A bound on the plane in focus as extension.
std::string AsExtension(const FocusPosition& position, Dioptres bound) {
  return LengthText(Metres{bound.value * position.sensor_distance.value * position.sensor_distance.value}, 3);
}

/// `position` with so much more extension, as uncertain.
FocusPosition Beyond(const FocusPosition& position, Metres more) {
  FocusPosition there = position;
  there.extension = position.extension + more;
  there.sensor_distance = position.focal_length + there.extension;
  there.focal_plane = optics::FocalPlane(position.focal_length, there.extension);
  const double ratio = position.sensor_distance / there.sensor_distance;
  there.bound = position.bound * (ratio * ratio);
  return there;
}

/// `position` at another f-number, as uncertain.
IrisPosition OtherAperture(const IrisPosition& position, double f_number) {
  const double ratio = f_number / position.f_number.value;
  return {position.f_number * ratio, position.lowest * ratio, position.highest * ratio};
}

/// A share of the way from one position to the next, as uncertain as the worse of both.
FocusPosition Between(const FocusPosition& from, const FocusPosition& to, double share) {
  FocusPosition there = from;
  there.focal_length = Metres{std::lerp(from.focal_length.value, to.focal_length.value, share)};
  there.extension = Metres{std::lerp(from.extension.value, to.extension.value, share)};
  there.sensor_distance = Metres{std::lerp(from.sensor_distance.value, to.sensor_distance.value, share)};
  there.focal_plane = Dioptres{std::lerp(from.focal_plane.value, to.focal_plane.value, share)};
  there.bound = std::max(from.bound, to.bound);
  return there;
}
IrisPosition BetweenApertures(const IrisPosition& from, const IrisPosition& to, double share) {
  const auto between = [share](FNumber a, FNumber b) { return FNumber{std::lerp(a.value, b.value, share)}; };
  return {between(from.f_number, to.f_number), between(from.lowest, to.lowest), between(from.highest, to.highest)};
}

/// Up to `around` positions on both sides of one, with 63 others between two neighbours.
template <class Position, class Middle>
std::vector<Position> Finer(const std::vector<Position>& positions, std::size_t middle, std::size_t around,
                            const Middle& between) {
  constexpr int kFiner = 64;
  const std::size_t first = middle - std::min(middle, around);
  const std::size_t last = std::min(middle + around, positions.size() - 1);
  std::vector<Position> all;
  for (std::size_t i = first; i < last; ++i) {
    for (int k = 0; k < kFiner; ++k) all.push_back(between(positions[i], positions[i + 1], k / double{kFiner}));
  }
  all.push_back(positions[last]);
  return all;
}

class CauseSearch {
 public:
  CauseSearch(const RefusedPlan& refused, const std::stop_token& stop)
      : refused_(refused), stop_(stop), real_(refused.planning.motors.Of(refused.planning, refused.now)) {}

  std::vector<optics::PlanCause> Take() {
    LiftMotor(Axis::Focus);
    LiftMotor(Axis::Iris);
    LiftCalibration();
    const auto on_real = [this](const PlanRequest& request) -> std::optional<optics::PlanAnswer> {
      auto found = Find(request, real_->lens, real_->blocks);
      return found ? std::optional(std::move(found->plan)) : std::nullopt;
    };
    for (auto& cause : optics::CausesInRequest(asked(), on_real)) causes_.push_back(std::move(cause));
    LiftPositions();
    LiftApertures();
    LiftTravel();
    LiftZoom();
    return std::move(causes_);
  }

 private:
  const PlanRequest& asked() const { return refused_.asked.plan; }
  /// A client waits for its refusal: what has not been tried by then is not named.
  bool Over() const { return stop_.stop_requested() || MonotonicClock().Now() >= until_; }
  void Add(const char* cause, std::string reason) { causes_.push_back({cause, std::move(reason)}); }

  std::optional<optics::PositionPlan> Find(const PlanRequest& request, const LensPositions& lens,
                                           const optics::FocusBlocks& blocks) const {
    if (Over()) return std::nullopt;
    return optics::PlanOnPositionsIfAny(request, lens, blocks, OriginOf(refused_.planning.scale, refused_.asked));
  }
  std::optional<optics::PositionPlan> Find(const PlanRequest& request, const LensPositions& lens) const {
    return Find(request, lens, optics::FocusBlocks(lens.focus));
  }

  /// Backlash, and steps that may be lost on the way.
  void LiftMotor(Axis axis) {
    if (!refused_.now.axes[axis]) return;
    rig::Status exact = refused_.now;
    rig::Arrival& arrival = exact.axes[axis]->arrival;
    const bool unknown = BacklashUnknown(arrival);
    if (arrival.backlash <= 0.0 && arrival.lost_travel <= 0.0) return;
    arrival.backlash = arrival.not_taken_up = arrival.lost_travel = 0.0;
    const MotorPositions motors = MotorPositionsOf(refused_.planning, exact);
    const auto found = Find(asked(), motors.lens, motors.blocks);
    if (!found) return;
    const std::string advice =
        unknown ? ": backlash not known): " + BacklashAdvice(refused_.lens, axis) : " by its motor)";
    if (axis == Axis::Focus) {
      const FocusPosition &there = real_->lens.focus[found->focus], &known = motors.lens.focus[found->focus];
      return Add("focusUncertainty",
                 "the uncertainty of focus (" + AsExtension(there, there.bound - known.bound) + advice);
    }
    const IrisPosition& there = real_->lens.iris[found->iris];
    Add("irisUncertainty", "the uncertainty of the iris (f/" + Short(there.lowest.value, 3) + " to f/" +
                               Short(there.highest.value, 3) + advice);
  }

  /// What the calibration of focus leaves open, and tolerances that stand for it.
  void LiftCalibration() {
    const auto open = [](const FocusPosition& position) { return position.bound.value > 0.0; };
    if (std::ranges::none_of(refused_.planning.positions.focus, open)) return;
    Planning exact = refused_.planning;
    exact.positions.focal_length_error = 0.0;
    for (FocusPosition& position : exact.positions.focus) position.bound = {};
    StateTolerances(exact);
    PlanRequest request = asked();
    if (refused_.asked.own.sensor_tolerance) request.sensor_tolerance = exact.defaults.sensor_tolerance;
    const MotorPositions motors = MotorPositionsOf(exact, refused_.now);
    const auto found = Find(request, motors.lens, motors.blocks);
    if (!found) return;
    const FocusPosition& there = refused_.planning.positions.focus[found->focus];
    Add("calibration",
        "the error of the calibration (" + AsExtension(there, there.bound) + "): lensctl calibrate " + refused_.lens);
  }

  /// Places between those at which the motors can stand, near the best of these and as uncertain; none beyond them,
  /// which backlash keeps from the ends of the travel.
  void LiftPositions() {
    if (!refused_.answer.continuous_feasible) return;
    if (!asked().focus) {
      LensPositions lens = real_->lens;
      lens.focus = Finer(lens.focus, refused_.answer.focus, 32, Between);
      lens.iris = Finer(lens.iris, refused_.answer.iris, 16, BetweenApertures);
      if (!Find(asked(), lens)) return;
    }
    Add("positions", "the places at which its motors can stand: a setting between them would do, see the nearest");
  }

  /// The f-numbers asked for, low and high.
  std::pair<double, double> AskedFNumbers() const {
    const auto f_number = [&](const optics::Number& given) {
      return asked().apertures_are_diameters ? real_->lens.focal_length.value / given.value : given.value;
    };
    return std::minmax({f_number(asked().f_numbers.low), f_number(asked().f_numbers.high)});
  }

  /// Apertures that the lens has not, where the request does not leave them out itself: it does if its range ends
  /// before or beyond the lens' own.
  void LiftApertures() {
    if (!asked().stops.empty()) return;
    constexpr double kSame = 1.001, kLeastRatio = 1.02, kFixedRatio = 1.02;
    LensPositions lens = real_->lens;
    std::vector<IrisPosition>& iris = lens.iris;
    const IrisPosition widest = iris.front(), smallest = iris.back();
    const auto ratio = [&](std::size_t at) {
      return iris.size() < 2 ? kFixedRatio : std::max(kLeastRatio, iris[at + 1].f_number / iris[at].f_number);
    };
    const double wider = ratio(0), smaller = ratio(std::max<std::size_t>(iris.size(), 2) - 2);
    auto [low, high] = AskedFNumbers();
    if (high * kSame >= smallest.f_number.value) {
      if (high <= smallest.f_number.value * kSame) high = optics::kSmallestFNumber;
      for (double n = smallest.f_number.value * smaller; n <= high; n *= smaller) {
        iris.push_back(OtherAperture(smallest, n));
      }
    }
    if (low <= widest.f_number.value * kSame) {
      if (low * kSame >= widest.f_number.value) low = optics::kWidestFNumber;
      std::vector<IrisPosition> added;
      for (double n = widest.f_number.value / wider; n >= low; n /= wider) added.push_back(OtherAperture(widest, n));
      iris.insert(iris.begin(), added.rbegin(), added.rend());
    }
    PlanRequest request = asked();
    request.apertures_are_diameters = false;
    request.f_numbers = {std::min(low, high), high};
    const auto found = Find(request, lens, real_->blocks);
    if (!found) return;
    const std::string first = "f/" + Short(widest.f_number.value), last = "f/" + Short(smallest.f_number.value);
    Add("aperture", (real_->lens.iris.size() < 2 ? "the fixed aperture " + first
                                                 : "the apertures that the lens has (" + first + " to " + last + ")") +
                        ": f/" + Short(found->plan.f_number.value, 3) + " would do");
  }

  /// A range of f-numbers that holds no position means the nearest one.
  void WidenByAStep(optics::NumberRange& f_numbers) const {
    if (refused_.answer.request.apertures_are_diameters) return;
    double widest = 1.0;
    const std::vector<IrisPosition>& iris = real_->lens.iris;
    for (std::size_t j = 1; j < iris.size(); ++j) widest = std::max(widest, iris[j].f_number / iris[j - 1].f_number);
    f_numbers = {f_numbers.low.value / widest, f_numbers.high.value * widest};
  }

  /// Where beyond an end of its travel focus would have to go, whatever its steps and its motor's bounds are; nothing:
  /// that does not help.
  std::optional<Metres> WantedBeyond(const FocusPosition& end, bool outward) const {
    PlanRequest request = refused_.answer.request;  // the lens everywhere as it is at one position
    (outward ? request.extensions.low : request.extensions.high) = end.extension.value;
    // A fixed focus counts whatever the extensions that are asked for.
    const auto& own = refused_.asked.own;
    if (outward && (own.extension_high || request.focus)) request.extensions.high = request.focal_length;
    if (!outward && (own.extension_low || request.focus)) request.extensions.low = 0.0;
    if (request.extensions.low.value >= request.extensions.high.value) return std::nullopt;
    if (request.objective == optics::Objective::Light) request.objective = optics::Objective::Sharp;
    request.wavelength.reset();
    if (request.focus) request.limits.clear();  // that is where it is; a position beside it may keep the limits
    WidenByAStep(request.f_numbers);
    request.sensor_tolerance = asked().sensor_tolerance;
    request.f_number_tolerance = asked().f_number_tolerance;
    const auto plan = optics::PlanIfAny(request);
    return plan ? std::optional(plan->extension) : std::nullopt;
  }

  /// Positions beyond an end of the travel, in its steps, near where focus would have to go.
  LensPositions LongerTo(Metres wanted, bool outward) const {
    LensPositions lens = real_->lens;
    const std::vector<FocusPosition>& focus = real_->lens.focus;
    const FocusPosition& end = outward ? focus.back() : focus.front();
    const Metres off = wanted - end.extension;
    if (focus.size() < 2) {
      lens.focus = {Beyond(end, off)};
      return lens;
    }
    constexpr double kAround = 64.0;
    const Metres step =
        outward ? end.extension - focus[focus.size() - 2].extension : end.extension - focus[1].extension;
    const double middle = std::round(off / step);
    std::vector<FocusPosition> added;
    for (double k = std::max(1.0, middle - kAround); k <= middle + kAround; ++k) added.push_back(Beyond(end, step * k));
    outward ? lens.focus.insert(lens.focus.end(), added.begin(), added.end())
            : lens.focus.insert(lens.focus.begin(), added.rbegin(), added.rend());
    return lens;
  }

  void LiftTravel() {
    const std::vector<FocusPosition>& focus = real_->lens.focus;
    if (real_->lens.liquid || Over()) return;
    PlanRequest request = asked();
    const auto& own = refused_.asked.own;
    if (own.extension_low) request.extensions.low = std::min(request.extensions.low.value, 0.0);
    if (own.extension_high)
      request.extensions.high = std::max(request.extensions.high.value, focus.back().focal_length.value);
    for (const bool outward : {true, false}) {
      const FocusPosition& end = outward ? focus.back() : focus.front();
      const auto wanted = WantedBeyond(end, outward);
      const auto found = wanted ? Find(request, LongerTo(*wanted, outward)) : std::nullopt;
      if (!found) continue;
      const auto place = [](Dioptres plane) {
        return plane.value > 0.0 ? LengthText(Metres{1.0 / plane.value}, 3) : std::string("infinity");
      };
      return Add("travel", (focus.size() < 2 ? "the fixed focus at " : "the travel of focus, which ends at ") +
                               place(end.focal_plane) + ": focus at " + place(found->plan.focal_plane) +
                               " from the lens centre would do");
    }
  }

  void LiftZoom() {
    const rig::OpticsTable& optics = *refused_.planning.lens.optics;
    if (!optics.has_zoom() || !optics.conditions().zoom || Over()) return;
    proto::LensRequest free = refused_.asked;
    const bool chosen = free.focal_lengths.has_value();
    // Who fixes the frame wants no other one; and looking through a zoom takes up to a second.
    if (free.field || (chosen && free.focal_lengths->first == free.focal_lengths->second)) return;
    free.focal_lengths = std::pair(Metres{0.0}, Metres{std::numeric_limits<double>::infinity()});
    std::stop_source over;
    const std::stop_callback at_the_end(stop_, [&over] { over.request_stop(); });
    const std::jthread timer([&over, left = until_ - MonotonicClock().Now()](const std::stop_token& done) {
      std::mutex mutex;
      std::unique_lock lock(mutex);
      std::condition_variable_any().wait_for(lock, done, left, [] { return false; });
      over.request_stop();
    });
    const auto zoomed = PlanningForZoom(refused_.planning.lens, refused_.config, free, refused_.now, over.get_token());
    if (!zoomed) return;
    free.plan = zoomed->request;
    const auto motors = MotorPositionsOf(zoomed->planning, refused_.now);
    if (!Find(free.plan, motors.lens, motors.blocks)) return;
    Add("zoom", "the focal length" +
                    (chosen ? std::string(" that is asked for")
                            : " of " + LengthText(refused_.planning.lens.optics->focal_length(), 3)) +
                    ": " + LengthText(zoomed->planning.lens.optics->focal_length(), 6) + " would do");
  }

  const RefusedPlan& refused_;
  const std::stop_token& stop_;
  const Instant until_ = MonotonicClock().Now() + std::chrono::seconds(3);
  const std::shared_ptr<const MotorPositions> real_;
  std::vector<optics::PlanCause> causes_;
};

}  // namespace

std::string BacklashAdvice(const std::string& lens, Axis axis) {
  const std::string command = "lensctl backlash " + lens;
  return axis == Axis::Focus ? command : command + " " + std::string(drivers::AxisName(axis)) + " --steps N";
}

std::vector<optics::PlanCause> CausesOf(const RefusedPlan& refused, const std::stop_token& stop) {
  return CauseSearch(refused, stop).Take();
}

}  // namespace lensd::daemon
