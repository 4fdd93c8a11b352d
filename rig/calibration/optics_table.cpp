// Positions to optics and back through the curves of optics_table_lens.h, weighted as the conditions of the moment say.
// Every conversion is a pure function of the table, so any thread may ask.
#include "rig/optics_table.h"

#include <algorithm>
#include <cmath>

#include "rig/calibration/optics_table_lens.h"

namespace lensd::rig {

using drivers::NativeUnit;

const drivers::NominalOptics& OpticsTable::nominal() const {
  return lens_->nominal;
}
bool OpticsTable::has_focus(Direction direction) const {
  return lens_->focus.has_value() && (direction == Direction::NotNeeded || lens_->direction.direction);
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
  return focal_length_ * lens_->Ratio(extension.value - (lens_->nominal.liquid ? 0.0 : offset_m_));
}

Dioptres OpticsTable::VergenceFromExtension(Metres extension) const {
  return lens_->Vergence(focal_length_.value, extension.value, offset_m_);
}

Result<Metres> OpticsTable::ExtensionInFocus(optics::ObjectDepth depth) const {
  std::optional<Metres> longest;
  if (lens_->focus) {
    longest = std::max(ExtensionFromNative(lens_->focus->minimum), ExtensionFromNative(lens_->focus->maximum));
  } else {
    longest = Metres{lens_->nominal.max_extension_m};
  }
  auto extension = lens_->Extension(focal_length_.value, depth, longest, offset_m_);
  if (!extension) return PassOn(extension);
  return Metres{*extension};
}

Metres OpticsTable::centre_shift() const {
  const auto& shifts = lens_->centre_shift;
  if (shifts.empty()) return Metres{0.0};
  const double f = focal_length_.value;
  const auto above = std::ranges::lower_bound(shifts, f, {}, &std::pair<double, double>::first);
  if (above == shifts.begin()) return Metres{above->second};
  if (above == shifts.end()) return Metres{shifts.back().second};
  const auto below = above - 1;
  return Metres{std::lerp(below->second, above->second, (f - below->first) / (above->first - below->first))};
}

// ---- errors -------------------------------------------------------------------------------------------------------

Metres OpticsTable::TemperatureError() const {
  if (!lens_->temperature) return Metres{0.0};
  const TemperatureModel& model = *lens_->temperature;
  const Metres drift{std::abs(model.per_degree.value)};
  if (!conditions_.temperature) return (drift + model.per_degree_error) * range_c_;
  const double unsure = 0.5 * kTemperatureStep.value;
  return model.per_degree_error * (range_c_ + unsure) + drift * (lens_->compensate ? unsure : range_c_ + unsure);
}

/// Past its ends a curve goes straight on; how far the nominal figures would have it elsewhere is an estimate of how
/// wrong that is.
double OpticsTable::CurveError(double native) const {
  if (parts_.empty()) {
    if (lens_->nominal_unsure == 0.0) return 0.0;
    const double on = lens_->NominalExtension(native + lens_->nominal_unsure, focal_length_);
    return std::abs(on - lens_->NominalExtension(native, focal_length_));
  }
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
    const double unsure = FocalLengthError();
    error +=
        std::max(change(focal_length * (1.0 + unsure), extension), change(focal_length * (1.0 - unsure), extension));
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
