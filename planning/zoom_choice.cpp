// How well a focal length serves a request is a continuous problem for the lens as it is there: breathing, a moving
// centre and distances from elsewhere are counted at the extension the answer has, found in a few rounds. The places of
// the zoom are tried coarsely, then ever more finely around the best of those; positions of the motors come last.
#include "planning/zoom_choice.h"

#include <algorithm>
#include <cmath>
#include <compare>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/quantity_text.h"
#include "optics/framing.h"
#include "optics/stack.h"

namespace lensd::daemon {
namespace {

using drivers::Axis;

constexpr double kNever = std::numeric_limits<double>::max();

/// Smaller is better; what comes first counts first.
struct Merit {
  double relax = kNever;  ///< by which the limits would have to be relaxed; 1: they hold
  double shots = 0.0;     ///< of a stack
  double aim = kNever;    ///< of the objective
  double travel = 0.0;    ///< of the zoom
  auto operator<=>(const Merit&) const = default;
};

Merit MeritOf(const optics::StackAnswer& stack, double breathing) {
  if (!stack.feasible) return {};
  return {1.0, static_cast<double>(stack.shots.size()), stack.shots.front().f_number.value / breathing};
}

Merit MeritOf(const optics::PlanAnswer& plan, optics::Objective objective, double breathing) {
  if (!plan.feasible) return {plan.relax.value_or(kNever)};
  switch (objective) {
    case optics::Objective::Light:
      return {1.0, 0.0, plan.f_number.value / breathing};
    case optics::Objective::Sharp:
      return {1.0, 0.0, plan.worst_ratio};
    case optics::Objective::Depth:
      break;
  }
  const auto& field = plan.depth_of_field;
  return {1.0, 0.0, field ? field->other_end.number.value - field->one_end.number.value : 0.0};
}

/// One request at the places of one zoom.
class ZoomScan {
 public:
  ZoomScan(const PlannedLens& lens, const rig::RigConfig& config, const proto::LensRequest& asked, std::stop_token stop)
      : table_(*lens.optics), config_(config), asked_(asked), zoom_(*lens.axes[Axis::Zoom]), stop_(std::move(stop)) {
    if (table_.has_focus(rig::OpticsTable::Direction::NotNeeded))
      ends_ = std::pair(lens.axes[Axis::Focus]->low, lens.axes[Axis::Focus]->high);
  }

  /// The places of [first, last], both of the zoom's grid, that were tried, the best first.
  std::vector<std::pair<Merit, Native>> Ranked(Native first, Native last, optics::Objective objective) {
    objective_ = objective;
    const auto steps = std::lround((last - first).value / zoom_.resolution);
    first_ = first;
    tried_.clear();
    long stride = std::max(1L, steps / MostAtOnce());
    for (long i = 0; i < steps; i += stride) Try(i);
    Try(steps);
    while (stride > 1) {
      const long finer = std::max(1L, stride / 8);
      for (const long middle : Valleys()) {
        const long end = std::min(steps, middle + stride);
        for (long i = std::max(0L, middle - stride); i <= end; i += finer) Try(i);
      }
      stride = finer;
    }
    std::vector<std::pair<Merit, Native>> ranked;
    for (const auto& [i, merit] : tried_) ranked.emplace_back(merit, Place(i));
    std::ranges::sort(ranked);
    return ranked;
  }

 private:
  static constexpr std::size_t kValleys = 8;

  Native Place(long i) const { return first_ + Native{zoom_.resolution * static_cast<double>(i)}; }
  /// Many limits take their time, and diffraction does: fewer places then.
  long MostAtOnce() const {
    constexpr long kLeast = 32, kLimits = 200000;
    const long most = asked_.plan.wavelength ? 500 : 10000;
    const auto limits = static_cast<long>(asked_.plan.limits.size());
    return std::clamp(kLimits / std::max(1L, limits), kLeast, most);
  }
  void Try(long i) {
    if (!tried_.contains(i) && !stop_.stop_requested()) tried_.emplace(i, MeritAt(Place(i)));
  }
  /// Of the places tried those no worse than their neighbours, the best first.
  std::vector<long> Valleys() const {
    std::vector<std::pair<Merit, long>> valleys;
    for (auto here = tried_.begin(); here != tried_.end(); ++here) {
      const bool falls = here == tried_.begin() || here->second <= std::prev(here)->second;
      const auto next = std::next(here);
      if (falls && (next == tried_.end() || here->second <= next->second)) {
        valleys.emplace_back(here->second, here->first);
      }
    }
    std::ranges::sort(valleys);
    if (valleys.size() > kValleys) valleys.resize(kValleys);
    std::vector<long> places;
    for (const auto& [merit, place] : valleys) places.push_back(place);
    return places;
  }

  /// The whole request for the lens as it is with the zoom at a place and focus at an extension.
  optics::PlanRequest RequestAt(const rig::OpticsTable& table, const optics::PlanRequest& asked,
                                const optics::LensPositions& lens) const {
    return optics::RequestAtFirst(asked, lens, OriginOf(ScaleUnder(table, config_), asked_));
  }

  /// What the request asks with the ranges that are the lens' own at this zoom.
  optics::PlanRequest AskedAt(const rig::OpticsTable& table) const {
    optics::PlanRequest asked = asked_.plan;
    asked.objective = objective_;
    if (!ends_ || table.grade() == rig::Grade::Uncalibrated) return asked;
    const auto [low, high] =
        std::minmax({table.ExtensionFromNative(ends_->first), table.ExtensionFromNative(ends_->second)});
    if (asked_.own.extension_low) asked.extensions.low = low.value;
    if (asked_.own.extension_high) asked.extensions.high = high.value;
    return asked;
  }

  Merit MeritAt(Native place) {
    rig::Conditions there = table_.conditions();
    there.zoom = place;
    const rig::OpticsTable table = table_.In(there);
    const optics::PlanRequest asked = AskedAt(table);
    const double error = table.FNumberError();
    const FNumber n{asked.f_numbers.low.value};
    optics::LensPositions lens{.focal_length = table.focal_length(),
                               .focal_length_error = table.FocalLengthError(),
                               .liquid = false,
                               .focus = {},
                               .iris = {{n, n * (1.0 - error), n * (1.0 + error)}}};
    Metres extension{0.5 * (asked.extensions.low.value + asked.extensions.high.value)};
    Merit merit;
    constexpr int kRounds = 5;
    for (int round = 0; round < kRounds; ++round) {
      lens.focus = {StandsAt(table, extension)};
      const Metres before = extension;
      merit = MeritHere(RequestAt(table, asked, lens), lens, extension);
      constexpr double kSame = 1e-7;
      if (std::abs((extension - before).value) <= kSame * table.focal_length().value) break;
    }
    merit.travel = std::abs((place - *table_.conditions().zoom).value);
    return merit;
  }

  /// Leaves in `extension` where the answer has focus.
  Merit MeritHere(const optics::PlanRequest& request, const optics::LensPositions& lens, Metres& extension) const {
    const double breathing = lens.focus.front().focal_length / lens.focal_length;
    if (asked_.stack) {
      const auto stack = optics::PlanStack(request);
      if (!stack) return {};
      if (stack->feasible) extension = stack->shots.front().extension;
      return MeritOf(*stack, breathing);
    }
    const auto plan = optics::Plan(request);
    if (!plan) return {};
    if (plan->feasible || plan->relax) extension = plan->extension;
    return MeritOf(*plan, request.objective, breathing);
  }

  const rig::OpticsTable& table_;
  const rig::RigConfig& config_;
  const proto::LensRequest& asked_;
  const AxisGrid& zoom_;
  const std::stop_token stop_;
  std::optional<std::pair<Native, Native>> ends_;  ///< of focus
  optics::Objective objective_{};
  Native first_;
  std::map<long, Merit> tried_;
};

/// The focal lengths a zoom reaches, and its grid.
struct ZoomAxis {
  const PlannedLens& lens;
  const AxisGrid& grid;
  Metres shortest, longest;

  explicit ZoomAxis(const PlannedLens& planned) : lens(planned), grid(*planned.axes[Axis::Zoom]) {
    const rig::OpticsTable& table = *lens.optics;
    std::tie(shortest, longest) =
        std::minmax({table.FocalLengthFromNative(grid.low), table.FocalLengthFromNative(grid.high)});
  }
  Native Nearest(Metres focal_length) const {
    const double places = (lens.optics->NativeFromFocalLength(focal_length) - grid.origin).value / grid.resolution;
    return std::clamp(grid.origin + Native{grid.resolution * std::round(places)}, grid.low, grid.high);
  }
  PlannedLens At(Native zoom) const {
    rig::Conditions there = lens.optics->conditions();
    there.zoom = zoom;
    PlannedLens zoomed = lens;
    zoomed.optics = std::make_shared<const rig::OpticsTable>(lens.optics->In(there));
    return zoomed;
  }
};

/// Where the zoom frames the field with focus on it. Breathing and a moving centre depend on where that is.
Result<Native> Framing(const ZoomAxis& zoom, const rig::RigConfig& config, const proto::LensRequest& asked,
                       Metres sensor_width, std::pair<Metres, Metres> wanted) {
  Native place = zoom.Nearest(wanted.first);
  double breathing = 1.0;
  constexpr int kRounds = 6;
  for (int round = 0; round < kRounds; ++round) {
    const PlannedLens zoomed = zoom.At(place);
    const rig::OpticsTable& there = *zoomed.optics;
    optics::FocusScale scale = ScaleUnder(there, config);
    scale.from = asked.from.value_or(scale.from);
    const optics::Field field{asked.field->width, asked.field->distance, scale};
    const auto f =
        optics::FramingFocalLength(field, sensor_width, {wanted.first * breathing, wanted.second * breathing});
    if (!f) return PassOn(f);
    const auto depth = optics::DepthInFocus(scale, *f, field.distance);
    const auto extension = depth ? there.ExtensionInFocus(*depth) : PassOn(depth);
    if (extension && there.has_focus(rig::OpticsTable::Direction::NotNeeded))
      breathing = there.FocalLengthAt(*extension) / there.focal_length();
    place = zoom.Nearest(*f / breathing);
  }
  return place;
}

ZoomedPlanning ZoomedTo(PlannedLens lens, const rig::RigConfig& config, const proto::LensRequest& asked) {
  ZoomedPlanning zoomed{PlanningUnder(std::move(lens), config), asked.plan};
  zoomed.planning.zoom = zoomed.planning.lens.optics->conditions().zoom;
  const optics::PlanRequest& own = zoomed.planning.defaults;
  if (asked.own.extension_low) zoomed.request.extensions.low = own.extensions.low;
  if (asked.own.extension_high) zoomed.request.extensions.high = own.extensions.high;
  if (asked.own.sensor_tolerance) zoomed.request.sensor_tolerance = own.sensor_tolerance;
  if (asked.own.f_number_tolerance) zoomed.request.f_number_tolerance = own.f_number_tolerance;
  zoomed.request.calibration_error = own.calibration_error;
  return zoomed;
}

/// What the motors' positions make of it with the zoom there.
Merit MeritOnPositions(const ZoomedPlanning& zoomed, const proto::LensRequest& asked, const rig::Status& now) {
  proto::LensRequest there = asked;
  there.plan = zoomed.request;
  if (asked.stack) {
    const auto stack = StackFor(zoomed.planning, there, now);
    return stack ? MeritOf(stack->answer.stack, 1.0) : Merit{};
  }
  const auto plan = PlanFor(zoomed.planning, there, now);
  if (!plan) return {};
  const optics::PlanAnswer& answer = plan->answer.plan;
  if (!answer.feasible && plan->answer.continuous_feasible) return {answer.worst_ratio};
  return MeritOf(answer, asked.plan.objective, 1.0);
}

/// Looks for the best place on the motors' positions. What a place is worth as a continuous problem is the most it can
/// be worth there, so that only those that promise more than the best so far have to be looked at so closely, the most
/// promising first. Where they are more than there is time for, some spread over all of the zoom follow, since what
/// spoils a place often spoils its neighbours too, and then those around the best.
class PositionSearch {
 public:
  PositionSearch(const rig::RigConfig& config, const proto::LensRequest& asked, const ZoomAxis& zoom,
                 const rig::Status& now, std::stop_token stop)
      : config_(config), asked_(asked), zoom_(zoom), now_(now), stop_(std::move(stop)) {}

  /// `ranked`: places and what they promise, the best first. `binding`: the promises are of the request's own
  /// objective.
  void Among(std::vector<std::pair<Merit, Native>> ranked, bool binding) {
    constexpr std::size_t kSpread = 64, kAround = 16;
    binding_ = binding;
    const auto first = ranked.begin() + static_cast<std::ptrdiff_t>(std::min(MostLooks(), ranked.size()));
    for (auto place = ranked.begin(); place != first; ++place) {
      if (!Promises(place->first)) return;
      Look(*place);
    }
    std::erase_if(ranked,
                  [&](const auto& place) { return looked_at_.contains(place.second) || !Promises(place.first); });
    std::ranges::sort(ranked, {}, &std::pair<Merit, Native>::second);
    const std::size_t stride = ranked.size() / kSpread + 1;
    for (std::size_t i = 0; i < ranked.size(); i += stride) Look(ranked[i]);
    if (!best_) return;
    for (std::size_t near = stride; near > 1;) {
      near = near / kAround + 1;
      const auto best =
          std::ranges::lower_bound(ranked, *best_->second.planning.zoom, {}, &std::pair<Merit, Native>::second);
      const auto middle = static_cast<std::size_t>(best - ranked.begin());
      for (std::size_t i = middle - std::min(middle, near * kAround); i < ranked.size() && i <= middle + near * kAround;
           i += near) {
        Look(ranked[i]);
      }
    }
  }
  const Merit& merit() const { return best_->first; }
  ZoomedPlanning Take() { return std::move(best_->second); }

 private:
  /// A second or so.
  std::size_t MostLooks() const {
    const double positions = asked_.plan.wavelength ? 5e5 : 5e6;
    double each = 1.0;
    for (const Axis axis : {Axis::Focus, Axis::Iris}) {
      const auto& grid = zoom_.lens.axes[axis];
      if (grid) each += (grid->high - grid->low).value / grid->resolution;
    }
    return static_cast<std::size_t>(std::clamp(positions / each, 32.0, 1e4));
  }
  bool Promises(Merit promise) const {
    if (!best_ || !binding_) return true;
    constexpr double kHair = 1.0 - 1e-3;  // tolerances differ a little from zoom to zoom
    if (promise.relax > 1.0) promise.relax = std::max(1.0, promise.relax * kHair);
    return promise < best_->first;
  }
  void Look(const std::pair<Merit, Native>& place) {
    if (stop_.stop_requested() || !Promises(place.first) || !looked_at_.insert(place.second).second) return;
    ZoomedPlanning there = ZoomedTo(zoom_.At(place.second), config_, asked_);
    Merit merit = MeritOnPositions(there, asked_, now_);
    merit.travel = place.first.travel;
    if (!best_ || merit < best_->first) best_.emplace(merit, std::move(there));
  }

  const rig::RigConfig& config_;
  const proto::LensRequest& asked_;
  const ZoomAxis& zoom_;
  const rig::Status& now_;
  const std::stop_token stop_;
  bool binding_ = true;
  std::set<Native> looked_at_;
  std::optional<std::pair<Merit, ZoomedPlanning>> best_;
};

Result<ZoomedPlanning> BestZoom(const ZoomAxis& zoom, const rig::RigConfig& config, const proto::LensRequest& asked,
                                const rig::Status& now, std::pair<Native, Native> range, const std::stop_token& stop) {
  const Error stopped{Code::Cancelled, "lensd is stopping"};
  ZoomScan scan(zoom.lens, config, asked, stop);
  PositionSearch search(config, asked, zoom, now, stop);
  search.Among(scan.Ranked(range.first, range.second, asked.plan.objective), true);
  if (stop.stop_requested()) return PassOn(stopped);
  // Where the most light leaves no room for the motors' steps, the focal length with the most room may.
  if (search.merit().relax > 1.0 && asked.plan.objective == optics::Objective::Light) {
    search.Among(scan.Ranked(range.first, range.second, optics::Objective::Sharp), false);
  }
  if (stop.stop_requested()) return PassOn(stopped);
  return search.Take();
}

}  // namespace

Result<ZoomedPlanning> PlanningForZoom(const PlannedLens& lens, const rig::RigConfig& config,
                                       const proto::LensRequest& asked, const rig::Status& now,
                                       const std::stop_token& stop) {
  if (!lens.optics->has_zoom() || !lens.optics->conditions().zoom) {
    return Fail(Code::OutOfRange, "this lens does not zoom: leave out the focal length and the field to frame",
                {.axis = "zoom", .parameter = asked.focal_lengths ? "focalLengthMm" : "field"});
  }
  const ZoomAxis zoom(lens);
  const auto wanted = asked.focal_lengths.value_or(std::pair(zoom.shortest, zoom.longest));
  constexpr double kRounding = 1e-9;
  if (wanted.second < zoom.shortest * (1.0 - kRounding) || wanted.first > zoom.longest * (1.0 + kRounding)) {
    return Fail(Code::OutOfRange,
                "this lens zooms from " + LengthText(zoom.shortest, 6) + " to " + LengthText(zoom.longest, 6),
                {.axis = "zoom",
                 .parameter = "focalLengthMm",
                 .minimum = zoom.shortest.value * 1e3,
                 .maximum = zoom.longest.value * 1e3,
                 .unit = "mm"});
  }
  const std::pair within(std::max(zoom.shortest, wanted.first), std::min(zoom.longest, wanted.second));
  if (asked.field) {
    const auto width = asked.sensor_width ? asked.sensor_width : lens.sensor_width;
    if (!width)
      return Fail(Code::InvalidArgument, "framing a field needs the sensor's width: give sensorWidthMm",
                  {.parameter = "sensorWidthMm"});
    const auto place = Framing(zoom, config, asked, *width, within);
    if (!place) return PassOn(place);
    return ZoomedTo(zoom.At(*place), config, asked);
  }
  const auto [first, last] = std::minmax({zoom.Nearest(within.first), zoom.Nearest(within.second)});
  if (first == last) return ZoomedTo(zoom.At(first), config, asked);
  return BestZoom(zoom, config, asked, now, {first, last}, stop);
}

}  // namespace lensd::daemon
