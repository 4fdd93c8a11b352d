// From what is known of a lens to positions a planner can choose from. Each stands for the plane it truly focuses on
// and for how far that may be off: the motor's own bound, the calibration's, the temperature's and the focal length's.
#include "planning/planning.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "optics/framing.h"
#include "planning/plan_reach.h"
#include "planning/zoom_choice.h"

namespace lensd::daemon {
namespace {

using drivers::Axis;
using optics::FocusPosition;
using optics::IrisPosition;

/// Every position within the soft limits.
std::vector<Native> PositionsOf(const AxisGrid& grid) {
  std::vector<Native> positions;
  const double first = std::ceil((grid.low - grid.origin).value / grid.resolution - 1e-9);
  for (double step = first;; ++step) {
    const Native native{grid.origin.value + step * grid.resolution};
    if (native.value > grid.high.value + 1e-9 * grid.resolution) break;
    positions.push_back(native);
  }
  return positions;
}

FocusPosition PositionAt(const rig::OpticsTable& optics, Native native) {
  FocusPosition position = StandsAt(optics, optics.ExtensionFromNative(native));
  position.bound = optics.VergenceError(native);
  return position;
}

/// Sorts positions by what they mean.
template <class Position, class Key>
void Sort(std::vector<Position>& positions, std::vector<Native>& natives, Key key) {
  if (std::ranges::is_sorted(positions, {}, key)) return;
  std::vector<std::pair<Position, Native>> both;
  for (std::size_t i = 0; i < positions.size(); ++i) both.emplace_back(positions[i], natives[i]);
  std::ranges::stable_sort(both, {}, [&](const auto& pair) { return std::invoke(key, pair.first); });
  for (std::size_t i = 0; i < positions.size(); ++i) std::tie(positions[i], natives[i]) = both[i];
}

void AddPositions(Planning& planning) {
  const rig::OpticsTable& optics = *planning.lens.optics;
  const drivers::NominalOptics& nominal = optics.nominal();
  optics::LensPositions& positions = planning.positions;
  positions.focal_length = nominal.liquid ? Metres{nominal.focal_length_m} : optics.focal_length();
  positions.focal_length_error = optics.FocalLengthError();
  positions.liquid = nominal.liquid;
  if (optics.has_focus(rig::OpticsTable::Direction::NotNeeded)) {
    planning.focus = PositionsOf(*planning.lens.axes[Axis::Focus]);
    for (const Native native : planning.focus) positions.focus.push_back(PositionAt(optics, native));
    Sort(positions.focus, planning.focus, &FocusPosition::focal_plane);
    // What there is can be planned with, but not where the motor has to go for it.
    if (!optics.has_focus()) planning.focus.clear();
  } else {
    positions.focus.push_back(StandsAt(optics, Metres{nominal.min_extension_m}));
  }
  if (optics.has_iris()) {
    planning.iris = PositionsOf(*planning.lens.axes[Axis::Iris]);
    for (const Native native : planning.iris) positions.iris.push_back(OpenAt(optics, native, {}));
    Sort(positions.iris, planning.iris, &IrisPosition::f_number);
  } else {
    const FNumber only{nominal.min_f_number};
    positions.iris.push_back({only, only, only});
  }
}

std::optional<Native> NativeAt(const std::vector<Native>& natives, std::size_t index) {
  return natives.empty() ? std::nullopt : std::optional(natives[index]);
}

}  // namespace

FocusPosition StandsAt(const rig::OpticsTable& optics, Metres extension) {
  const Metres focal_length = optics.FocalLengthAt(extension);
  return {.focal_length = focal_length,
          .extension = extension,
          .sensor_distance = focal_length + extension,
          .focal_plane = optics.VergenceFromExtension(extension),
          .bound = {}};
}

optics::FocusScale ScaleUnder(const rig::OpticsTable& optics, const rig::RigConfig& config) {
  optics::FocusScale scale = config.scale;
  scale.centre_shift = optics.centre_shift();
  return scale;
}

optics::DistanceOrigin OriginOf(const optics::FocusScale& scale, const proto::LensRequest& asked) {
  switch (asked.from.value_or(scale.from)) {
    case optics::DistanceFrom::Lens:
      break;
    case optics::DistanceFrom::Sensor:
      return {.at_sensor = true, .behind = scale.principal_gap + scale.centre_shift};
    case optics::DistanceFrom::Front:
      return {.at_sensor = false, .behind = scale.centre_shift - scale.front_to_centre};
  }
  return {.at_sensor = false, .behind = scale.centre_shift};
}

// Half the largest distance between neighbours, or half their largest ratio.
void StateTolerances(Planning& planning) {
  double step = 0.0, ratio = 1.0, nominal = 0.0;
  const auto& focus = planning.positions.focus;
  const auto& iris = planning.positions.iris;
  const bool calibrated = planning.lens.optics->grade() != rig::Grade::Uncalibrated;
  for (std::size_t i = 0; i < focus.size(); ++i) {
    const double z = focus[i].sensor_distance.value;
    const double before = i > 0 ? std::abs((focus[i].extension - focus[i - 1].extension).value) : 0.0;
    step = std::max(step, 0.5 * before + focus[i].bound.value * z * z);
    if (!calibrated || planning.focus.empty()) continue;
    const Metres stated = planning.lens.optics->NominalExtension(planning.focus[i]);
    nominal = std::max(nominal, std::abs((stated - focus[i].extension).value));
  }
  for (std::size_t j = 1; j < iris.size(); ++j) {
    ratio = std::max(ratio, (iris[j].f_number / iris[j - 1].f_number));
  }
  planning.defaults.sensor_tolerance = step;
  planning.defaults.f_number_tolerance = std::sqrt(ratio) * (1.0 + planning.lens.optics->FNumberError()) - 1.0;
  planning.defaults.calibration_error = Metres{nominal};
}

Planning PlanningUnder(PlannedLens lens, const rig::RigConfig& config) {
  Planning planning;
  planning.scale = ScaleUnder(*lens.optics, config);
  planning.lens = std::move(lens);
  AddPositions(planning);
  const auto& [focus, iris] = std::tie(planning.positions.focus, planning.positions.iris);
  const drivers::NominalOptics& nominal = planning.lens.optics->nominal();
  optics::PlanRequest& request = planning.defaults;
  request.focal_length = planning.positions.focal_length.value;
  request.f_numbers = {iris.front().f_number.value, iris.back().f_number.value};
  request.extensions = {focus.front().extension.value, focus.back().extension.value};
  if (planning.lens.optics->grade() == rig::Grade::Uncalibrated) {
    // As stated, without the rounding of their steps.
    request.f_numbers = {nominal.min_f_number, nominal.max_f_number};
    request.extensions = {nominal.min_extension_m, nominal.max_extension_m};
  }
  request.liquid = nominal.liquid;
  request.pupil_factor = config.pupil_factor;
  if (config.wavelength && !nominal.liquid) request.wavelength = config.wavelength->value;
  request.pixel = planning.lens.pixel;
  StateTolerances(planning);
  return planning;
}

std::optional<Planning> PlanningOf(const rig::Rig& rig, const rig::RigConfig& config) {
  if (rig.optics() == nullptr) return std::nullopt;
  PlannedLens lens{std::make_shared<const rig::OpticsTable>(*rig.optics()), {}, std::nullopt, std::nullopt};
  for (const Axis axis : drivers::kAxes) {
    const auto& can = rig.lens().axes[axis];
    if (!can) continue;
    const auto [low, high] = rig.SoftLimits(axis);
    lens.axes[axis] = AxisGrid{can->minimum, can->resolution, low, high};
  }
  if (const auto* camera = rig.camera(); camera != nullptr && camera->pixel_um > 0.0) {
    lens.pixel = Metres{camera->pixel_um * 1e-6};
    lens.sensor_width = *lens.pixel * static_cast<double>(camera->width);
  }
  return PlanningUnder(std::move(lens), config);
}

namespace {

/// How wide the field that was asked for is with focus there; nothing where none was.
std::optional<Metres> FieldWidthAt(const Planning& planning, const proto::LensRequest& asked,
                                   const optics::FocusPosition& there) {
  const auto sensor = asked.sensor_width ? asked.sensor_width : planning.lens.sensor_width;
  if (!asked.field || !sensor) return std::nullopt;
  const Metres depth = asked.field->distance - OriginOf(planning.scale, asked).At(there);
  return optics::FieldWidth(there.focal_length, there.extension, *sensor, depth);
}

}  // namespace

Result<LensPlan> PlanFor(const Planning& planning, const proto::LensRequest& asked, const rig::Status& now) {
  const auto motors = planning.motors.Of(planning, now);
  const optics::LensPositions& positions = motors->lens;
  if (auto reach = CheckReach(asked.plan, positions, planning.zoom ? Zoomed::Yes : Zoomed::No); !reach)
    return PassOn(reach);
  auto answer = optics::PlanOnPositions(asked.plan, positions, motors->blocks, OriginOf(planning.scale, asked));
  if (!answer) return PassOn(answer);
  LensPlan plan{*std::move(answer), std::nullopt, std::nullopt, planning.zoom, std::nullopt};
  const optics::FocusPosition& there = positions.focus[plan.answer.focus];
  plan.field_width = FieldWidthAt(planning, asked, there);
  plan.focus = NativeAt(planning.focus, plan.answer.focus);
  plan.iris = NativeAt(planning.iris, plan.answer.iris);
  return plan;
}

Result<LensStack> StackFor(const Planning& planning, const proto::LensRequest& asked, const rig::Status& now) {
  const auto motors = planning.motors.Of(planning, now);
  const optics::LensPositions& positions = motors->lens;
  if (auto reach = CheckReach(asked.plan, positions, planning.zoom ? Zoomed::Yes : Zoomed::No); !reach)
    return PassOn(reach);
  auto answer = optics::StackOnPositions(asked.plan, positions, motors->blocks, OriginOf(planning.scale, asked));
  if (!answer) return PassOn(answer);
  LensStack stack{.answer = *std::move(answer), .shots = {}, .focus = {}, .iris = std::nullopt};
  for (const std::size_t i : stack.answer.focus) {
    stack.shots.push_back(positions.focus[i]);
    if (const auto width = FieldWidthAt(planning, asked, positions.focus[i])) stack.field_widths.push_back(*width);
    if (const auto native = NativeAt(planning.focus, i)) stack.focus.push_back(*native);
  }
  stack.iris = NativeAt(planning.iris, stack.answer.iris);
  return stack;
}

std::optional<optics::PlanAnswer> CheckNow(const rig::Status& now, const rig::RigConfig& config,
                                           const proto::LensRequest& asked) {
  if (!now.optics || rig::LacksDirection(*now.optics)) return std::nullopt;
  const rig::OpticsTable& optics = *now.optics;
  const drivers::NominalOptics& nominal = optics.nominal();
  const double zoom_error = ZoomErrorNow(optics, now);
  optics::LensPositions positions{
      .focal_length = nominal.liquid ? Metres{nominal.focal_length_m} : optics.focal_length(),
      .focal_length_error = optics.FocalLengthError() + zoom_error,
      .liquid = nominal.liquid,
      .focus = {},
      .iris = {}};
  const auto &focus = now.axes[Axis::Focus], &iris = now.axes[Axis::Iris];
  if (optics.has_focus()) {
    if (!focus) return std::nullopt;
    FocusPosition position = PositionAt(optics, focus->position);
    const auto off = [&](Native native) {
      return std::abs((optics.VergenceFromExtension(optics.ExtensionFromNative(native)) - position.focal_plane).value);
    };
    const Dioptres reach{std::max(off(focus->position - focus->bound), off(focus->position + focus->bound))};
    position.bound = position.bound + reach + ZoomShift(position, zoom_error);
    positions.focus.push_back(position);
  } else {
    positions.focus.push_back(StandsAt(optics, Metres{nominal.min_extension_m}));
  }
  if (optics.has_iris()) {
    if (!iris) return std::nullopt;
    positions.iris.push_back(OpenAt(optics, iris->position, iris->bound));
  } else {
    const FNumber only{nominal.min_f_number};
    positions.iris.push_back({only, only, only});
  }
  optics::PlanRequest request = asked.plan;
  request.sensor_tolerance = request.f_number_tolerance = optics::Number(0.0);
  auto answer = optics::CheckPosition(request, positions, OriginOf(ScaleUnder(optics, config), asked));
  if (!answer) return std::nullopt;
  return *std::move(answer);
}

}  // namespace lensd::daemon
