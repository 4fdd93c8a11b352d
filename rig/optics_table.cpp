#include "rig/optics_table.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "curve.h"
#include "optics/conjugates.h"

namespace lensd::rig {
namespace {

using drivers::NativeUnit;

double Span(const drivers::AxisCapabilities& axis) {
  return (axis.maximum - axis.minimum).value;
}

}  // namespace

/// What does not depend on the conditions.
struct OpticsTable::Lens {
  drivers::NominalOptics nominal;
  std::shared_ptr<const Calibration> calibration;  ///< may be null
  double tolerance = 0.0;                          ///< of the focal length
  std::optional<Metres> wavelength;
  bool compensate = false;
  std::optional<TemperatureModel> temperature;
  double extension_at_minimum_m = 0.0;  ///< of the focus axis' native range, nominally
  double extension_at_maximum_m = 0.0;
  std::optional<drivers::AxisCapabilities> focus, iris, zoom;

  struct Focus {
    const FocusCurve* measured = nullptr;
    std::optional<Curve> extension;  ///< metres over native, as if approached from the lens' own side
    bool from_vergence = false;      ///< what was measured is where it focuses, not how far the sensor is
    double error_m = 0.0;            ///< the curve's own, and that of the backlash it was shifted by
  };
  std::vector<Focus> curves;
  std::optional<Curve> iris_curve;  ///< log(f-number) over native
  std::optional<Curve> zoom_curve;  ///< metres over native
  std::optional<Curve> breathing;   ///< ratio over metres of extension

  /// A liquid lens' power is even across its axis.
  double LiquidExtensionAt(double part) const {
    const double low = 1.0 / (nominal.focal_length_m - extension_at_minimum_m);
    const double high = 1.0 / (nominal.focal_length_m - extension_at_maximum_m);
    return nominal.focal_length_m - 1.0 / std::lerp(low, high, part);
  }
  double NominalExtension(double native, Metres focal_length) const {
    if (nominal.liquid) return LiquidExtensionAt((native - focus->minimum.value) / Span(*focus));
    if (focus->unit == NativeUnit::Dioptres) return optics::Extension(focal_length, Dioptres{native}).value;
    if (focus->unit == NativeUnit::Millimetres) return native * 1e-3;
    return std::lerp(extension_at_minimum_m, extension_at_maximum_m, (native - focus->minimum.value) / Span(*focus));
  }
  double NominalNative(double extension, Metres focal_length) const {
    if (nominal.liquid) {
      const double low = 1.0 / (nominal.focal_length_m - extension_at_minimum_m);
      const double high = 1.0 / (nominal.focal_length_m - extension_at_maximum_m);
      const double part = (1.0 / (nominal.focal_length_m - extension) - low) / (high - low);
      return std::lerp(focus->minimum.value, focus->maximum.value, part);
    }
    if (focus->unit == NativeUnit::Dioptres) return optics::FocalPlane(focal_length, Metres{extension}).value;
    if (focus->unit == NativeUnit::Millimetres) return extension * 1e3;
    const double part = (extension - extension_at_minimum_m) / (extension_at_maximum_m - extension_at_minimum_m);
    return std::lerp(focus->minimum.value, focus->maximum.value, part);
  }
  /// Focal length over that at extension 0.
  double Ratio(double extension) const {
    if (nominal.liquid) return 1.0 - extension / nominal.focal_length_m;
    if (!breathing) return 1.0;
    return breathing->At(std::clamp(extension, breathing->low(), breathing->high()));
  }
  Dioptres Vergence(double focal_length, double extension) const {
    return optics::FocalPlane(Metres{focal_length * Ratio(extension)}, Metres{extension});
  }
  Result<double> Extension(double focal_length, optics::ObjectDepth depth, std::optional<Metres> longest) const;
  Result<void> AddFocus(const FocusCurve& measured, const RigConfig& config);
  Result<void> AddCalibration(const RigConfig& config);
};

/// With breathing the extension lies between those of the shortest and the longest focal length.
Result<double> OpticsTable::Lens::Extension(double focal_length, optics::ObjectDepth depth,
                                            std::optional<Metres> longest) const {
  if (nominal.liquid) {
    const double z = nominal.focal_length_m, u = depth.vergence().value;
    if (!(1.0 + z * u > 0.0)) return Fail(Code::OutOfRange, "no power of this lens focuses there");
    return z * z * u / (1.0 + z * u);
  }
  if (!breathing) {
    auto plain = optics::FocusExtension(Metres{focal_length}, depth, longest);
    if (!plain) return PassOn(std::move(plain));
    return plain->value;
  }
  double least = 1.0, most = 1.0;
  for (const BreathingPoint& point : calibration->breathing) {
    least = std::min(least, point.ratio);
    most = std::max(most, point.ratio);
  }
  if (auto possible = optics::FocusExtension(Metres{focal_length * most}, depth, longest); !possible) {
    return PassOn(std::move(possible));
  }
  const double a = optics::Extension(Metres{focal_length * least}, depth).value;
  const double b = optics::Extension(Metres{focal_length * most}, depth).value;
  if (a == b) return a;
  return SolveMonotone([&](double e) { return Vergence(focal_length, e).value; }, depth.vergence().value,
                       std::min(a, b), std::max(a, b));
}

/// A position that was reached from the other side means what a position farther along by the backlash means: the
/// mechanism lags behind the motor by half of it either way.
Result<void> OpticsTable::Lens::AddFocus(const FocusCurve& measured, const RigConfig& config) {
  const auto& axis = config.axes[drivers::Axis::Focus];
  Focus entry{.measured = &measured, .extension = {}, .from_vergence = false, .error_m = measured.error.value};
  double shift = 0.0, unsure = 0.0;
  if (measured.approach_near != axis.approach_near) {
    const auto& known = calibration->backlash[drivers::Axis::Focus];
    if (!known && !axis.backlash) {
      return Fail(Code::InvalidArgument,
                  "the calibration was made moving toward the other side than this lens approaches from: measure its "
                  "backlash, or calibrate it with this approach");
    }
    const double backlash = axis.backlash ? *axis.backlash : known->steps;
    unsure = axis.backlash ? 0.0 : std::max(known->high - known->steps, known->steps - known->low);
    const bool upward = axis.approach_near == axis.near_positive;
    shift = upward ? backlash : -backlash;
  }
  const double at_zoom = measured.focal_length.value_or(Metres{nominal.focal_length_m}).value;
  std::vector<Curve::Knot> knots;
  for (const FocusPoint& point : measured.points) {
    double extension = point.extension.value_or(Metres{}).value;
    if (point.vergence) {
      entry.from_vergence = true;
      const auto focused = Extension(at_zoom, *point.vergence, std::nullopt);
      if (!focused) return std::unexpected(focused.error());
      extension = *focused;
    }
    if (!(extension > -at_zoom)) return Fail(Code::InvalidArgument, "the calibration puts the sensor at the lens");
    knots.push_back({point.position.value + shift, extension});
  }
  auto curve = Curve::Through(knots);
  if (!curve) return PassOn(std::move(curve));
  if (axis.near_positive ? !curve->rising() : !curve->falling()) {
    return Fail(Code::InvalidArgument, std::string("the calibration of focus must focus ") +
                                           (axis.near_positive ? "nearer" : "farther") +
                                           " from point to point: the lens is configured as near-" +
                                           (axis.near_positive ? "positive" : "negative"));
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
  }
  if (!focus) return {};
  // Curves of the lens' own approach make those of the other one needless.
  const bool approach_near = config.axes[drivers::Axis::Focus].approach_near;
  const bool own = std::ranges::any_of(calibration->focus,
                                       [&](const FocusCurve& curve) { return curve.approach_near == approach_near; });
  for (const FocusCurve& curve : calibration->focus) {
    if (own && curve.approach_near != approach_near) continue;
    if (auto added = AddFocus(curve, config); !added) return added;
  }
  return {};
}

Result<OpticsTable> OpticsTable::Create(const drivers::NominalOptics& optics, const drivers::Capabilities& lens,
                                        bool near_positive) {
  RigConfig config;
  config.axes[drivers::Axis::Focus].near_positive = near_positive;
  return Create(optics, lens, config, nullptr);
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
  const bool near_positive = config.axes[drivers::Axis::Focus].near_positive;
  made->extension_at_minimum_m = near_positive ? optics.min_extension_m : optics.max_extension_m;
  made->extension_at_maximum_m = near_positive ? optics.max_extension_m : optics.min_extension_m;
  const auto& focus = lens.axes[drivers::Axis::Focus];
  const bool focus_known =
      optics.max_extension_m > optics.min_extension_m || (made->calibration && !made->calibration->focus.empty());
  if (focus && Span(*focus) > 0 && focus_known) made->focus = focus;
  const auto& iris = lens.axes[drivers::Axis::Iris];
  const bool iris_known = optics.max_f_number > optics.min_f_number || (made->calibration && made->calibration->iris);
  if (iris && Span(*iris) > 0 && iris_known) made->iris = iris;
  const auto& zoom = lens.axes[drivers::Axis::Zoom];
  const bool zoom_known = optics.max_focal_length_m > optics.focal_length_m ||
                          (zoom && zoom->unit == NativeUnit::Millimetres) ||
                          (made->calibration && made->calibration->zoom);
  if (zoom && Span(*zoom) > 0 && zoom_known) made->zoom = zoom;

  const TemperatureConfig& temperature = config.temperature;
  if (made->calibration) made->temperature = made->calibration->temperature;
  if (temperature.metres_per_degree) {
    made->temperature = made->temperature.value_or(TemperatureModel{});
    made->temperature->per_degree = *temperature.metres_per_degree;
    made->temperature->per_degree_error = Metres{0.0};
  }
  if (made->temperature && temperature.reference) made->temperature->reference = *temperature.reference;
  if (temperature.compensate && !made->temperature) {
    return Fail(Code::InvalidArgument,
                "temperature cannot be compensated without a coefficient: give um_per_c in [lens.temperature] or in "
                "the calibration's [temperature]");
  }
  made->compensate = temperature.compensate;
  if (made->calibration) {
    if (auto added = made->AddCalibration(config); !added) return PassOn(std::move(added));
  }
  OpticsTable table;
  table.lens_ = std::move(made);
  return table.In({});
}

// ---- conditions ---------------------------------------------------------------------------------------------------

namespace {

/// Where a value lies between the ones there are: the two around it and their weights.
struct Bracket {
  double low = 0.0, high = 0.0;
  double toward_high = 0.0;
  bool outside = false;
};

Bracket Around(std::vector<double> values, std::optional<double> wanted) {
  std::ranges::sort(values);
  if (!wanted) return {values.front(), values.front(), 0.0, values.front() != values.back()};
  const double x = std::clamp(*wanted, values.front(), values.back());
  const auto above = std::ranges::lower_bound(values, x);
  const auto below = *above == x ? above : above - 1;
  // A zoom a millionth away from where a curve was measured is no other zoom.
  Bracket bracket{*below, *above, 0.0, std::abs(x - *wanted) > 1e-6 * std::abs(x)};
  if (*above > *below) bracket.toward_high = (x - *below) / (*above - *below);
  return bracket;
}

}  // namespace

OpticsTable OpticsTable::In(const Conditions& conditions) const {
  OpticsTable table;
  table.lens_ = lens_;
  table.conditions_ = conditions;
  table.focal_length_ = Metres{lens_->nominal.focal_length_m};
  if (has_zoom() && conditions.zoom) table.focal_length_ = FocalLengthFromNative(*conditions.zoom);
  table.ChooseCurves();
  table.SetTemperature();
  return table;
}

/// Curves of the filter in place; then, one key after another, those on either side of the conditions.
void OpticsTable::ChooseCurves() {
  const auto& curves = lens_->curves;
  const auto filter_of = [&](std::size_t i) { return curves[i].measured->filter; };
  const auto here = conditions_.filter ? std::optional(conditions_.filter->value) : std::nullopt;
  std::vector<std::size_t> with_filter, without;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    if (here && filter_of(i) == here) with_filter.push_back(i);
    if (!filter_of(i)) without.push_back(i);
  }
  if (with_filter.empty()) with_filter = without;
  if (with_filter.empty() && !curves.empty()) {
    // Measured through other filters only.
    for (std::size_t i = 0; i < curves.size(); ++i) with_filter.push_back(i);
    outside_ = true;
  }
  for (const std::size_t i : with_filter) parts_.push_back({i, 1.0 / static_cast<double>(with_filter.size())});
  const auto value = [](const auto& key) { return key ? std::optional(key->value) : std::nullopt; };
  const auto narrow = [&](auto key, std::optional<double> wanted, bool counts) {
    const bool inside = Narrow([&](const FocusCurve& curve) { return value(key(curve)); }, wanted);
    outside_ |= counts && !inside;
  };
  narrow([](const FocusCurve& curve) { return curve.focal_length; }, focal_length_.value, has_zoom());
  narrow([](const FocusCurve& curve) { return curve.wavelength; }, value(lens_->wavelength), true);
  narrow([](const FocusCurve& curve) { return curve.temperature; }, value(conditions_.temperature), false);
}

/// Keeps the curves whose key is nearest below and above what is wanted, weighted by how near. False: there is none on
/// one side.
bool OpticsTable::Narrow(const std::function<std::optional<double>(const FocusCurve&)>& key,
                         std::optional<double> wanted) {
  const auto key_of = [&](const Part& part) { return key(*lens_->curves[part.curve].measured); };
  std::vector<double> values;
  for (const Part& part : parts_) {
    if (const auto value = key_of(part)) values.push_back(*value);
  }
  if (values.empty()) return true;
  const Bracket around = Around(std::move(values), wanted);
  double low_weight = 0.0, high_weight = 0.0;
  for (const Part& part : parts_) {
    if (key_of(part) == around.low) low_weight += part.weight;
    if (key_of(part) == around.high) high_weight += part.weight;
  }
  std::vector<Part> chosen;
  for (Part part : parts_) {
    const auto value = key_of(part);
    if (value != around.low && value != around.high) continue;
    part.weight *= value == around.low ? (1.0 - around.toward_high) / low_weight : around.toward_high / high_weight;
    if (part.weight > 0.0) chosen.push_back(part);
  }
  parts_ = std::move(chosen);
  return !around.outside;
}

void OpticsTable::SetTemperature() {
  if (!lens_->temperature) return;
  const TemperatureModel& model = *lens_->temperature;
  double measured_at = parts_.empty() ? model.reference.value : 0.0;
  for (const Part& part : parts_) {
    measured_at += part.weight * lens_->curves[part.curve].measured->temperature.value_or(model.reference).value;
  }
  if (!conditions_.temperature) {
    range_c_ = std::max(std::abs(model.hottest.value - measured_at), std::abs(model.coldest.value - measured_at));
    return;
  }
  const double warmer = conditions_.temperature->value - measured_at;
  range_c_ = std::abs(warmer);
  if (lens_->compensate) offset_m_ = model.per_degree.value * warmer;
}

const drivers::NominalOptics& OpticsTable::nominal() const {
  return lens_->nominal;
}
double OpticsTable::focal_length_tolerance() const {
  return lens_->tolerance;
}
bool OpticsTable::has_focus() const {
  return lens_->focus.has_value();
}
bool OpticsTable::has_iris() const {
  return lens_->iris.has_value();
}
bool OpticsTable::has_zoom() const {
  return lens_->zoom.has_value();
}

std::optional<FNumber> OpticsTable::fixed_f_number() const {
  if (lens_->nominal.min_f_number < lens_->nominal.max_f_number) return std::nullopt;
  return FNumber{lens_->nominal.min_f_number};
}

// ---- focus --------------------------------------------------------------------------------------------------------

double OpticsTable::Curves(double native) const {
  if (parts_.empty()) return lens_->NominalExtension(native, focal_length_);
  double extension = 0.0;
  for (const Part& part : parts_) extension += part.weight * lens_->curves[part.curve].extension->At(native);
  return extension;
}

Metres OpticsTable::ExtensionFromNative(Native focus) const {
  return Metres{Curves(focus.value) + offset_m_};
}

Native OpticsTable::NativeFromExtension(Metres extension) const {
  const double wanted = extension.value - offset_m_;
  if (parts_.empty()) return Native{lens_->NominalNative(wanted, focal_length_)};
  if (parts_.size() == 1) return Native{lens_->curves[parts_[0].curve].extension->Inverse(wanted)};
  return Native{SolveMonotone([this](double native) { return Curves(native); }, wanted, lens_->focus->minimum.value,
                              lens_->focus->maximum.value)};
}

Metres OpticsTable::NominalExtension(Native focus) const {
  return Metres{lens_->NominalExtension(focus.value, focal_length_)};
}

Metres OpticsTable::FocalLengthAt(Metres extension) const {
  return focal_length_ * lens_->Ratio(extension.value);
}

Dioptres OpticsTable::VergenceFromExtension(Metres extension) const {
  return lens_->Vergence(focal_length_.value, extension.value);
}

Result<Metres> OpticsTable::ExtensionInFocus(optics::ObjectDepth depth) const {
  std::optional<Metres> longest;
  if (has_focus()) {
    longest = std::max(ExtensionFromNative(lens_->focus->minimum), ExtensionFromNative(lens_->focus->maximum));
  } else {
    longest = Metres{lens_->nominal.max_extension_m};
  }
  auto extension = lens_->Extension(focal_length_.value, depth, longest);
  if (!extension) return PassOn(std::move(extension));
  return Metres{*extension};
}

// ---- errors -------------------------------------------------------------------------------------------------------

Metres OpticsTable::TemperatureError() const {
  if (!lens_->temperature) return Metres{0.0};
  const TemperatureModel& model = *lens_->temperature;
  const bool corrected = lens_->compensate && conditions_.temperature.has_value();
  return (corrected ? model.per_degree_error : Metres{std::abs(model.per_degree.value)} + model.per_degree_error) *
         range_c_;
}

/// Past its ends a curve goes straight on; how far the nominal figures would have it elsewhere is an estimate of how
/// wrong that is.
double OpticsTable::CurveError(double native) const {
  double error = 0.0;
  for (const Part& part : parts_) {
    const Lens::Focus& curve = lens_->curves[part.curve];
    const double end = std::clamp(native, curve.extension->low(), curve.extension->high());
    double here = curve.error_m;
    if (end != native && lens_->nominal.max_extension_m > lens_->nominal.min_extension_m) {
      const double nominal =
          lens_->NominalExtension(native, focal_length_) - lens_->NominalExtension(end, focal_length_);
      here += std::abs(curve.extension->At(native) - curve.extension->At(end) - nominal);
    }
    error = std::max(error, here);
  }
  return error;
}

Metres OpticsTable::ExtensionError(Native focus) const {
  Metres error = Metres{CurveError(focus.value)} + TemperatureError();
  const bool from_vergence =
      std::ranges::any_of(parts_, [&](const Part& part) { return lens_->curves[part.curve].from_vergence; });
  // e = f² U/(1 - f U) at a vergence that is certain.
  if (from_vergence && lens_->tolerance > 0.0) {
    const Metres extension = ExtensionFromNative(focus);
    const Metres focal_length = FocalLengthAt(extension);
    const Metres longer = optics::Extension(focal_length * (1.0 + lens_->tolerance), VergenceFromExtension(extension));
    error = error + Metres{std::abs((longer - extension).value)};
  }
  return error;
}

Dioptres OpticsTable::VergenceError(Native focus) const {
  const Metres extension = ExtensionFromNative(focus);
  const Metres focal_length = FocalLengthAt(extension);
  const Metres off = Metres{CurveError(focus.value)} + TemperatureError();
  const Dioptres here = optics::FocalPlane(focal_length, extension);
  const auto change = [&](Metres f, Metres e) { return std::abs((optics::FocalPlane(f, e) - here).value); };
  double error = std::max(change(focal_length, extension + off), change(focal_length, extension - off));
  const bool from_vergence =
      std::ranges::any_of(parts_, [&](const Part& part) { return lens_->curves[part.curve].from_vergence; });
  if (!from_vergence) {
    error += std::max(change(focal_length * (1.0 + lens_->tolerance), extension),
                      change(focal_length * (1.0 - lens_->tolerance), extension));
  }
  return Dioptres{error};
}

double OpticsTable::FNumberError() const {
  return lens_->iris_curve ? lens_->calibration->iris->error : 0.0;
}

double OpticsTable::FocalLengthError() const {
  return std::max(lens_->tolerance, lens_->zoom_curve ? lens_->calibration->zoom->error : 0.0);
}

Grade OpticsTable::grade() const {
  if (parts_.empty()) return Grade::Uncalibrated;
  return outside_ ? Grade::Approximate : lens_->calibration->grade;
}

Grade OpticsTable::GradeAt(Native focus) const {
  const bool beyond = std::ranges::any_of(parts_, [&](const Part& part) {
    const Curve& curve = *lens_->curves[part.curve].extension;
    return focus.value < curve.low() || focus.value > curve.high();
  });
  return beyond ? Grade::Approximate : grade();
}

std::optional<Metres> OpticsTable::error() const {
  if (parts_.empty()) return std::nullopt;
  Metres worst{0.0};
  for (const Part& part : parts_) {
    const Curve& curve = *lens_->curves[part.curve].extension;
    worst = std::max({worst, ExtensionError(Native{curve.low()}), ExtensionError(Native{curve.high()})});
  }
  return worst;
}

// ---- iris and zoom ------------------------------------------------------------------------------------------------

FNumber OpticsTable::FNumberFromNative(Native native) const {
  const auto& iris = *lens_->iris;
  if (lens_->iris_curve) return FNumber{std::exp(lens_->iris_curve->At(native.value))};
  if (iris.unit == NativeUnit::FNumber) return FNumber{native.value};
  const double part = (native - iris.minimum).value / Span(iris);
  return FNumber{lens_->nominal.min_f_number *
                 std::pow(lens_->nominal.max_f_number / lens_->nominal.min_f_number, part)};
}

Native OpticsTable::NativeFromFNumber(FNumber f_number) const {
  const auto& iris = *lens_->iris;
  if (lens_->iris_curve) return Native{lens_->iris_curve->Inverse(std::log(f_number.value))};
  if (iris.unit == NativeUnit::FNumber) return Native{f_number.value};
  const double part = std::log(f_number.value / lens_->nominal.min_f_number) /
                      std::log(lens_->nominal.max_f_number / lens_->nominal.min_f_number);
  return Native{std::lerp(iris.minimum.value, iris.maximum.value, part)};
}

Metres OpticsTable::FocalLengthFromNative(Native native) const {
  const auto& zoom = *lens_->zoom;
  if (lens_->zoom_curve) return Metres{lens_->zoom_curve->At(native.value)};
  if (zoom.unit == NativeUnit::Millimetres) return Metres{native.value * 1e-3};
  const double part = (native - zoom.minimum).value / Span(zoom);
  return Metres{std::lerp(lens_->nominal.focal_length_m, lens_->nominal.max_focal_length_m, part)};
}

Native OpticsTable::NativeFromFocalLength(Metres focal_length) const {
  const auto& zoom = *lens_->zoom;
  if (lens_->zoom_curve) return Native{lens_->zoom_curve->Inverse(focal_length.value)};
  if (zoom.unit == NativeUnit::Millimetres) return Native{focal_length.value * 1e3};
  const double part = (focal_length.value - lens_->nominal.focal_length_m) /
                      (lens_->nominal.max_focal_length_m - lens_->nominal.focal_length_m);
  return Native{std::lerp(zoom.minimum.value, zoom.maximum.value, part)};
}

}  // namespace lensd::rig
