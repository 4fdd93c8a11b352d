// Making an optics table from what is stated of a lens and what was measured of it.
#include "rig/calibration/optics_table_lens.h"

#include <utility>

#include "rig/motion/axis_setup.h"

namespace lensd::rig {
namespace {

/// What is counted in this unit is larger for nearer subjects, by what it is.
bool GrowsTowardNear(drivers::NativeUnit unit) {
  return unit == drivers::NativeUnit::Dioptres || unit == drivers::NativeUnit::Millimetres;
}

}  // namespace

/// With breathing the extension lies between those of the shortest and the longest focal length.
Result<double> OpticsTable::Lens::Extension(double focal_length, optics::ObjectDepth depth,
                                            std::optional<Metres> longest, double warmth) const {
  if (nominal.liquid) {
    const double z = nominal.focal_length_m, u = depth.vergence().value;
    if (!(1.0 + z * u > 0.0)) return Fail(Code::OutOfRange, "no power of this lens focuses there");
    return z * z * u / (1.0 + z * u);
  }
  if (!breathing) {
    auto plain = optics::FocusExtension(Metres{focal_length}, depth, longest);
    if (!plain) return PassOn(plain);
    return plain->value;
  }
  double least = 1.0, most = 1.0;
  for (const BreathingPoint& point : calibration->breathing) {
    least = std::min(least, point.ratio);
    most = std::max(most, point.ratio);
  }
  if (auto possible = optics::FocusExtension(Metres{focal_length * most}, depth, longest); !possible) {
    return PassOn(possible);
  }
  const double a = optics::Extension(Metres{focal_length * least}, depth).value;
  const double b = optics::Extension(Metres{focal_length * most}, depth).value;
  if (a == b) return a;
  return SolveMonotone([&](double e) { return Vergence(focal_length, e, warmth).value; }, depth.vergence().value,
                       std::min(a, b), std::max(a, b));
}

/// The mechanism lags behind the motor by half of the backlash either way.
std::optional<OpticsTable::Lens::ApproachShift> OpticsTable::Lens::ShiftToOwnApproach(const AxisConfig& axis) const {
  double backlash = 0.0, unsure = 0.0;
  if (axis.backlash) {
    backlash = *axis.backlash;
  } else if (const auto* known = calibration ? &calibration->backlash[drivers::Axis::Focus] : nullptr;
             known && *known) {
    backlash = (*known)->steps;
    unsure = std::max((*known)->high - backlash, backlash - (*known)->low);
  } else if (focus && focus->backlash >= 0.0) {
    backlash = focus->backlash;
  } else if (focus && focus->unit != drivers::NativeUnit::Steps) {
    // Such a lens closes the loop behind its own gears.
  } else {
    return std::nullopt;
  }
  return ApproachShift{.native = direction.approach_up ? backlash : -backlash, .unsure = unsure};
}

/// Nominal figures are those of a lens moved toward near.
void OpticsTable::Lens::PlaceNominal(const AxisConfig& axis) {
  if (!focus || direction.approach_near) return;
  if (const auto shift = ShiftToOwnApproach(axis)) {
    nominal_shift = shift->native;
    nominal_unsure = shift->unsure;
  } else {
    nominal_unsure = kAssumedBacklash * Span(*focus);
  }
}

Result<void> OpticsTable::Lens::AddFocus(const FocusCurve& measured, const RigConfig& config) {
  const auto& axis = config.axes[drivers::Axis::Focus];
  Focus entry{.measured = &measured, .extension = {}, .from_vergence = false, .error_m = measured.error.value};
  double shift = 0.0, unsure = 0.0;
  if (measured.approach_near != direction.approach_near) {
    const auto known = ShiftToOwnApproach(axis);
    if (!known) {
      return Fail(Code::InvalidArgument,
                  "the calibration was made moving toward the other side than this lens approaches from: measure its "
                  "backlash, or calibrate it with this approach");
    }
    shift = known->native;
    unsure = known->unsure;
  }
  const double at_zoom = measured.focal_length.value_or(Metres{nominal.focal_length_m}).value;
  std::vector<Curve::Knot> knots;
  for (const FocusPoint& point : measured.points) {
    double extension = point.extension.value_or(Metres{}).value;
    if (point.vergence) {
      entry.from_vergence = true;
      const auto focused = Extension(at_zoom, *point.vergence, std::nullopt, 0.0);
      if (!focused) return PassOn(focused);
      extension = *focused;
    }
    if (!(extension > -at_zoom)) return Fail(Code::InvalidArgument, "the calibration puts the sensor at the lens");
    knots.push_back({point.position.value + shift, extension});
  }
  auto curve = Curve::Through(knots);
  if (!curve) return PassOn(curve);
  if (direction.near_positive() ? !curve->rising() : !curve->falling()) {
    const std::string why = direction.from == DirectionFrom::Configured
                                ? "the lens is configured as " + std::string(DirectionName(*direction.direction))
                                : "other points of it do";
    return Fail(Code::InvalidArgument, std::string("the calibration of focus must focus ") +
                                           (direction.near_positive() ? "nearer" : "farther") +
                                           " from point to point: " + why);
  }
  const double slope = std::abs((knots.back().value - knots.front().value) / (knots.back().at - knots.front().at));
  entry.error_m += unsure * slope;
  entry.extension = *std::move(curve);
  curves.push_back(std::move(entry));
  return {};
}

Result<void> OpticsTable::Lens::AddCalibration(const RigConfig& config) {
  std::vector<Curve::Knot> knots;
  const auto curve_of = [&](std::optional<Curve>& into, const char* what) -> Result<void> {
    auto curve = Curve::Through(knots);
    if (!curve) return Fail(Code::InvalidArgument, std::string(what) + ": " + curve.error().message);
    into = *std::move(curve);
    return {};
  };
  if (calibration->breathing.size() >= 2) {
    for (const BreathingPoint& point : calibration->breathing) knots.push_back({point.extension.value, point.ratio});
    if (auto done = curve_of(breathing, "breathing"); !done) return done;
  }
  if (calibration->iris && iris) {
    knots.clear();
    for (const auto& point : calibration->iris->points) knots.push_back({point.position.value, std::log(point.value)});
    if (auto done = curve_of(iris_curve, "iris"); !done) return done;
  }
  if (calibration->zoom && zoom) {
    knots.clear();
    for (const auto& point : calibration->zoom->points) knots.push_back({point.position.value, point.value});
    if (auto done = curve_of(zoom_curve, "zoom"); !done) return done;
    if (calibration->zoom->points.front().centre_shift) {
      centre_shift.clear();
      for (const auto& point : calibration->zoom->points) {
        centre_shift.emplace_back(point.value, point.centre_shift->value);
      }
      std::ranges::sort(centre_shift);
    }
  }
  if (!focus) return {};
  // Curves of the lens' own approach make those of the other one needless.
  const bool approach_near = direction.approach_near;
  const bool own = std::ranges::any_of(calibration->focus,
                                       [&](const FocusCurve& curve) { return curve.approach_near == approach_near; });
  for (const FocusCurve& curve : calibration->focus) {
    if (own && curve.approach_near != approach_near) continue;
    if (auto added = AddFocus(curve, config); !added) return added;
  }
  return {};
}

Result<OpticsTable> OpticsTable::Create(const drivers::NominalOptics& optics, const drivers::Capabilities& lens,
                                        const RigConfig& config, std::shared_ptr<const Calibration> calibration) {
  if (!(optics.focal_length_m > 0)) return Fail(Code::InvalidArgument, "a focal length must be above 0");
  if (!(optics.min_f_number > 0) || !(optics.max_f_number >= optics.min_f_number)) {
    return Fail(Code::InvalidArgument, "f-numbers must be above 0, the smaller first");
  }
  if (!(optics.max_extension_m >= optics.min_extension_m) || !(optics.min_extension_m > -optics.focal_length_m)) {
    return Fail(Code::InvalidArgument, "extensions must be above minus the focal length, the smaller first");
  }
  auto made = std::make_shared<Lens>();
  made->nominal = optics;
  made->calibration = std::move(calibration);
  made->tolerance = config.focal_length_tolerance;
  made->wavelength = config.wavelength;
  const auto& focus = lens.axes[drivers::Axis::Focus];
  if (focus) made->direction = DirectionOf(config.axes[drivers::Axis::Focus], *focus, made->calibration.get());
  const bool near_negative = made->direction.direction == drivers::Direction::NearNegative;
  const bool calibrated = made->calibration && !made->calibration->focus.empty();
  if (near_negative && focus && !optics.liquid && !calibrated && GrowsTowardNear(focus->unit)) {
    return Fail(Code::InvalidArgument,
                "focus of this lens counts in " + std::string(drivers::NativeUnitName(focus->unit)) +
                    ", which grow toward near, and its direction is near-negative: say \"near-positive\", or count "
                    "it in steps");
  }
  made->extension_at_minimum_m = near_negative ? optics.max_extension_m : optics.min_extension_m;
  made->extension_at_maximum_m = near_negative ? optics.min_extension_m : optics.max_extension_m;
  const bool focus_known =
      optics.max_extension_m > optics.min_extension_m || (made->calibration && !made->calibration->focus.empty());
  if (focus && Span(*focus) > 0 && focus_known) made->focus = focus;
  const auto& iris = lens.axes[drivers::Axis::Iris];
  const bool iris_known = optics.max_f_number > optics.min_f_number || (made->calibration && made->calibration->iris);
  if (iris && Span(*iris) > 0 && iris_known) made->iris = iris;
  const auto& zoom = lens.axes[drivers::Axis::Zoom];
  const bool zoom_known = optics.max_focal_length_m > optics.focal_length_m ||
                          (zoom && zoom->unit == drivers::NativeUnit::Millimetres) ||
                          (made->calibration && made->calibration->zoom);
  if (zoom && Span(*zoom) > 0 && zoom_known) made->zoom = zoom;

  if (made->zoom && optics.centre_shift_m != 0.0 && optics.max_focal_length_m > optics.focal_length_m) {
    made->centre_shift = {{optics.focal_length_m, 0.0}, {optics.max_focal_length_m, optics.centre_shift_m}};
  }
  const TemperatureConfig& temperature = config.temperature;
  if (made->calibration) made->temperature = made->calibration->temperature;
  if (temperature.metres_per_degree) {
    made->temperature = made->temperature.value_or(TemperatureModel{});
    made->temperature->per_degree = *temperature.metres_per_degree;
    made->temperature->per_degree_error = Metres{0.0};
  }
  if (made->temperature && temperature.reference) made->temperature->reference = *temperature.reference;
  // Without a coefficient the lens works, or it could never be given the calibration that has one.
  made->compensate = temperature.compensate && made->temperature;
  made->PlaceNominal(config.axes[drivers::Axis::Focus]);
  if (made->calibration) {
    if (auto added = made->AddCalibration(config); !added) return PassOn(added);
  }
  OpticsTable table;
  table.lens_ = std::move(made);
  return table.In({});
}

}  // namespace lensd::rig
