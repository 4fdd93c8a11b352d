#include "rig/optics_table.h"

#include <cmath>

#include "optics/conjugates.h"

namespace lensd::rig {
namespace {

double Span(const drivers::AxisCapabilities& axis) {
  return (axis.maximum - axis.minimum).value;
}

}  // namespace

Result<OpticsTable> OpticsTable::Create(const drivers::NominalOptics& optics, const drivers::Capabilities& lens,
                                        bool near_positive) {
  if (!(optics.focal_length_m > 0)) return Fail(Code::InvalidArgument, "a focal length must be above 0");
  if (!(optics.min_f_number > 0) || !(optics.max_f_number >= optics.min_f_number)) {
    return Fail(Code::InvalidArgument, "f-numbers must be above 0, the smaller first");
  }
  if (!(optics.max_extension_m >= optics.min_extension_m) || !(optics.min_extension_m > -optics.focal_length_m)) {
    return Fail(Code::InvalidArgument, "extensions must be above minus the focal length, the smaller first");
  }
  OpticsTable table;
  table.optics_ = optics;
  table.extension_at_minimum_m_ = near_positive ? optics.min_extension_m : optics.max_extension_m;
  table.extension_at_maximum_m_ = near_positive ? optics.max_extension_m : optics.min_extension_m;
  const auto& focus = lens.axes[drivers::Axis::Focus];
  const bool focus_moves = optics.max_extension_m > optics.min_extension_m;
  if (focus && Span(*focus) > 0 && focus_moves) table.focus_ = focus;
  const auto& iris = lens.axes[drivers::Axis::Iris];
  if (iris && Span(*iris) > 0 && optics.max_f_number > optics.min_f_number) table.iris_ = iris;
  return table;
}

std::optional<FNumber> OpticsTable::fixed_f_number() const {
  if (optics_.min_f_number < optics_.max_f_number) return std::nullopt;
  return FNumber{optics_.min_f_number};
}

Metres OpticsTable::ExtensionFromNative(Native focus) const {
  if (focus_->unit == drivers::NativeUnit::Dioptres) return optics::Extension(focal_length(), Dioptres{focus.value});
  if (focus_->unit == drivers::NativeUnit::Millimetres) return Metres{focus.value * 1e-3};
  const double part = (focus - focus_->minimum).value / Span(*focus_);
  return Metres{std::lerp(extension_at_minimum_m_, extension_at_maximum_m_, part)};
}

Native OpticsTable::NativeFromExtension(Metres extension) const {
  if (focus_->unit == drivers::NativeUnit::Dioptres) {
    return Native{optics::FocalPlane(focal_length(), extension).value};
  }
  if (focus_->unit == drivers::NativeUnit::Millimetres) return Native{extension.value * 1e3};
  const double part = (extension.value - extension_at_minimum_m_) / (extension_at_maximum_m_ - extension_at_minimum_m_);
  return Native{std::lerp(focus_->minimum.value, focus_->maximum.value, part)};
}

FNumber OpticsTable::FNumberFromNative(Native iris) const {
  if (iris_->unit == drivers::NativeUnit::FNumber) return FNumber{iris.value};
  const double part = (iris - iris_->minimum).value / Span(*iris_);
  return FNumber{optics_.min_f_number * std::pow(optics_.max_f_number / optics_.min_f_number, part)};
}

Native OpticsTable::NativeFromFNumber(FNumber f_number) const {
  if (iris_->unit == drivers::NativeUnit::FNumber) return Native{f_number.value};
  const double part =
      std::log(f_number.value / optics_.min_f_number) / std::log(optics_.max_f_number / optics_.min_f_number);
  return Native{std::lerp(iris_->minimum.value, iris_->maximum.value, part)};
}

}  // namespace lensd::rig
