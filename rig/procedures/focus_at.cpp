// A sample is kept as the position that was found, with the conditions it was found under. What that position would be
// now follows from the lens's own figures for both temperatures; another zoom, filter, light or approach has a surface
// of its own. So a new calibration corrects old samples too.
#include "rig/focus_at.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/quantity_text.h"
#include "rig/rig.h"

namespace lensd::rig {
namespace {

using drivers::Axis;

constexpr double kUncorrected = 2.0;  ///< degrees that are let pass where the lens' coefficient is not known
constexpr double kStepSigma = 0.29;   ///< standard deviation of what is rounded to whole steps: 1 / sqrt(12)
constexpr double kSameZoomSteps = 2.0;
constexpr double kEdge = 1e-9;  ///< of a coordinate's range: its end
constexpr double kSamePlace = 0.5;
constexpr double kAgain = 0.02;  ///< of a coordinate's range: the same place
constexpr double kNear = 0.25;   ///< of a coordinate's range: a sample so near tells the same

/// Why a sample of `then` says nothing of `now`; empty: it does.
std::string WhyOther(const Rig& rig, const FocusAtConditions& then, const FocusAtConditions& now) {
  const auto text = [](const auto& value) { return value ? Short(value->value) : std::string("not known"); };
  const auto other = [](const auto& one, const auto& two, double within) {
    return one.has_value() != two.has_value() || (one && std::abs(one->value - two->value) > within);
  };
  const auto& zoom = rig.lens().axes[Axis::Zoom];
  if (other(then.zoom, now.zoom, zoom ? kSameZoomSteps * zoom->resolution : 0.0)) {
    return "at zoom position " + text(then.zoom) + ", and the zoom is at " + text(now.zoom);
  }
  if (other(then.filter, now.filter, kSamePlace)) {
    return "through filter " + text(then.filter) + ", and the filter is " + text(now.filter);
  }
  if (other(then.wavelength, now.wavelength, 1e-9)) return "in light of another wavelength than is configured now";
  if (then.approach_up != now.approach_up) return "approached from the other side than is configured now";
  const bool known = then.temperature && now.temperature;
  if (!rig.GetStatus().compensates && known && other(then.temperature, now.temperature, kUncorrected)) {
    return "at " + text(then.temperature) + " C, it is " + text(now.temperature) +
           " C now, and positions are not worked out for that (compensate = false, or no coefficient is known)";
  }
  return "";
}

Result<void> RefuseOther(const Rig& rig, const FocusAtSamples& known, const FocusAtConditions& now) {
  for (std::size_t i = 0; i < known.samples.size(); ++i) {
    const std::string why = WhyOther(rig, known.samples[i].under, now);
    if (why.empty()) continue;
    return Fail(Code::Unsupported, "sample " + std::to_string(i + 1) + " of the focus surface was found " + why +
                                       ": go back there, or forget the surface and learn it again");
  }
  return {};
}

/// Where focus stands now for what `sample` found, and one standard deviation of what the temperature adds.
std::pair<double, double> PositionNow(const Rig& rig, const FocusAtSample& sample, const FocusAtConditions& now) {
  const OpticsTable* optics = rig.optics();
  if (optics == nullptr || !optics->has_focus() || !rig.GetStatus().compensates || !sample.under.temperature ||
      !now.temperature) {
    return {sample.position.value, 0.0};
  }
  const auto table = [&](const std::optional<Celsius>& temperature) {
    return optics->In({.zoom = sample.under.zoom, .filter = sample.under.filter, .temperature = temperature});
  };
  const Metres extension = table(sample.under.temperature).ExtensionFromNative(sample.position);
  const OpticsTable here = table(now.temperature);
  const double position = here.NativeFromExtension(extension).value;
  const auto calibration = rig.calibration();
  if (!calibration || !calibration->temperature) return {position, 0.0};
  const double error =
      calibration->temperature->per_degree_error.value * (now.temperature->value - sample.under.temperature->value);
  return {position, here.NativeFromExtension(extension + Metres{error}).value - position};
}

/// How sure the surface is there in its own terms; nothing: a sample that was used is near.
std::optional<double> UnsureAt(const FocusAtFit& fit, const std::vector<double>& at) {
  for (const auto& sample : fit.samples) {
    if (sample.outlier) continue;
    double far = 0.0;
    for (std::size_t i = 0; i < at.size(); ++i) {
      const double range = fit.surface->high[i] - fit.surface->low[i];
      far = std::max(far, std::abs(sample.at[i] - at[i]) / range);
    }
    if (far < kNear) return std::nullopt;
  }
  const auto there = fit.surface->At(at);
  return there ? std::optional(there->sigma) : std::nullopt;
}

/// A sample that is no outlier was found at the place of this one, or as good as there.
bool MeasuredAgain(const FocusAtFit& fit, const autofocus::SurfaceSample& outlier) {
  return std::ranges::any_of(fit.samples, [&](const autofocus::SurfaceSample& sample) {
    if (sample.outlier) return false;
    for (std::size_t i = 0; i < outlier.at.size(); ++i) {
      const double range = fit.surface->high[i] - fit.surface->low[i];
      if (std::abs(sample.at[i] - outlier.at[i]) > kAgain * range) return false;
    }
    return true;
  });
}

std::string RemarkOn(const FocusAtFit& fit) {
  std::string remark;
  if (!fit.surface->curvature_seen) {
    remark = "too few places to show curvature in every direction: sigma includes only the curvature that they suggest";
  }
  for (std::size_t i = 0; i < fit.samples.size(); ++i) {
    if (!fit.samples[i].outlier || !MeasuredAgain(fit, fit.samples[i])) continue;
    remark += (remark.empty() ? "" : "; ") + ("sample " + std::to_string(i + 1)) + " was measured again: forget it";
  }
  return remark;
}

/// An outlier again, once; else, of the corners and middles of the range, the one with no sample near it where the
/// surface is least sure.
std::optional<std::vector<double>> NextPlace(const FocusAtFit& fit) {
  const auto once = [&](const autofocus::SurfaceSample& sample) {
    return sample.outlier && !MeasuredAgain(fit, sample);
  };
  const auto outlier = std::ranges::find_if(fit.samples, once);
  if (outlier != fit.samples.end()) return outlier->at;
  const std::size_t coordinates = fit.surface->low.size();
  std::optional<std::vector<double>> best;
  double least_sure = 0.0;
  constexpr int kPlaces = 3;
  int count = 1;
  for (std::size_t i = 0; i < coordinates; ++i) count *= kPlaces;
  for (int number = 0; number < count; ++number) {
    std::vector<double> at;
    int rest = number;
    for (std::size_t i = 0; i < coordinates; ++i, rest /= kPlaces) {
      const double low = fit.surface->low[i], high = fit.surface->high[i];
      at.push_back(rest % kPlaces == 0 ? low : rest % kPlaces == 1 ? high : 0.5 * (low + high));
    }
    const auto unsure = UnsureAt(fit, at);
    if (!unsure || !(*unsure > least_sure)) continue;
    least_sure = *unsure;
    best = std::move(at);
  }
  return best;
}

}  // namespace

FocusAtConditions FocusAtConditionsOf(const Status& status, std::optional<Metres> wavelength) {
  const auto place = [&](Axis axis) {
    return status.axes[axis] ? std::optional(status.axes[axis]->position) : std::nullopt;
  };
  return {.zoom = place(Axis::Zoom),
          .filter = place(Axis::Filter),
          .temperature = status.temperature,
          .f_number = status.f_number,
          .wavelength = wavelength};
}

std::string OtherCoordinates(const std::vector<FocusAtCoordinate>& known, const std::vector<FocusAtCoordinate>& asked) {
  const auto text = [](const std::vector<FocusAtCoordinate>& coordinates) {
    std::string words;
    for (const FocusAtCoordinate& each : coordinates) {
      words += (words.empty() ? "" : ", ") + each.name + (each.unit.empty() ? "" : " in " + each.unit);
    }
    return words;
  };
  return "the focus surface has other coordinates or units: it has " + text(known) + ", and " + text(asked) +
         " was asked";
}

std::optional<Native> NativeSigma(const Rig& rig, Native position, Dioptres sigma) {
  const OpticsTable* optics = rig.optics();
  if (optics == nullptr || !optics->has_focus()) return std::nullopt;
  const double step = rig.lens().axes[Axis::Focus]->resolution;
  const auto vergence = [&](double native) {
    return optics->VergenceFromExtension(optics->ExtensionFromNative(Native{native})).value;
  };
  const double slope = (vergence(position.value + step) - vergence(position.value - step)) / (2.0 * step);
  return Native{std::hypot(sigma.value / slope, kStepSigma * step)};
}

Result<void> AddFocusAt(FocusAtSamples& known, const std::vector<FocusAtCoordinate>& coordinates, FocusAtSample sample,
                        const Rig& rig) {
  const Status status = rig.GetStatus();
  for (const Axis axis : {Axis::Focus, Axis::Zoom, Axis::Filter}) {
    if (auto lost = WhyLost(axis, status.axes[axis])) return PassOn(*std::move(lost));
    if (!status.axes[axis] || status.axes[axis]->homed || !rig.lens().axes[axis]->can_home) continue;
    return Fail(Code::NotHomed, "where " + std::string(AxisName(axis)) +
                                    " stands is not known, so a sample would lead elsewhere: home it first");
  }
  const auto [low, high] = rig.SoftLimits(Axis::Focus);
  if (sample.position < low || high < sample.position) {
    return Fail(Code::OutOfRange, "focus cannot stand at " + Short(sample.position.value), {.parameter = "position"});
  }
  sample.under.approach_up = rig.approaches_up(Axis::Focus);
  if (known.samples.empty()) known.coordinates = coordinates;
  if (known.coordinates != coordinates) {
    return Fail(Code::InvalidArgument,
                OtherCoordinates(known.coordinates, coordinates) + ": forget it first, or use these coordinates",
                {.parameter = "at"});
  }
  if (known.samples.size() >= FocusAtSamples::kMost) {
    return Fail(Code::OutOfRange, "a focus surface has 30 samples at most: forget some");
  }
  if (auto other = RefuseOther(rig, known, sample.under); !other) return other;
  known.samples.push_back(std::move(sample));
  return {};
}

std::string PlaceText(const std::vector<FocusAtCoordinate>& coordinates, const std::vector<double>& at) {
  constexpr int kDigits = 6;
  std::string text;
  for (std::size_t i = 0; i < coordinates.size() && i < at.size(); ++i) {
    text += (i == 0 ? "" : " ") + coordinates[i].name + "=" + Short(at[i], kDigits) + coordinates[i].unit;
  }
  return text;
}

Result<FocusAtFit> FitFocusAt(const FocusAtSamples& known, const Rig& rig, FocusAtConditions now) {
  now.approach_up = rig.approaches_up(Axis::Focus);
  if (auto other = RefuseOther(rig, known, now); !other) return PassOn(other);
  FocusAtFit fit;
  fit.coordinates = known.coordinates;
  if (known.samples.empty()) {
    fit.why_none = "no surface of focus is learned yet: focus in some places and add each as a sample";
    return fit;
  }
  const auto count = static_cast<double>(known.samples.size());
  for (const FocusAtSample& sample : known.samples) {
    const auto [position, sigma] = PositionNow(rig, sample, now);
    fit.samples.push_back({.at = sample.at, .focus = position, .sigma = sample.sigma.value});
    fit.correction.value += (position - sample.position.value) / count;
    fit.correction_sigma.value += sigma / count;
  }
  fit.correction_sigma.value = std::abs(fit.correction_sigma.value);
  auto surface = autofocus::FitCoordinateSurface(fit.samples);
  if (!surface) {
    fit.why_none = surface.error().message;
    return fit;
  }
  fit.surface = *std::move(surface);
  fit.next = NextPlace(fit);
  fit.remark = RemarkOn(fit);
  return fit;
}

namespace {

/// The refusal of a place outside the samples along one coordinate.
std::unexpected<Error> OutsideSamples(const FocusAtCoordinate& coordinate, double at, double low, double high) {
  const std::string in = coordinate.unit.empty() ? "" : " " + coordinate.unit;
  return Fail(Code::OutOfRange,
              coordinate.name + " = " + Short(at, 6) + in + " is " + Short(at < low ? low - at : at - high) + in +
                  " outside the samples (" + Short(low, 6) + " to " + Short(high, 6) + in +
                  "): focus there and add the sample",
              {.parameter = "at", .minimum = low, .maximum = high, .unit = coordinate.unit});
}

}  // namespace

Result<autofocus::SurfaceFocus> FocusAtFit::At(const std::vector<double>& at) const {
  if (!surface) return Fail(Code::OutOfRange, why_none, {.parameter = "at"});
  for (std::size_t i = 0; i < at.size() && i < coordinates.size(); ++i) {
    const double low = surface->low[i], high = surface->high[i];
    if (std::max(low - at[i], at[i] - high) <= kEdge * (high - low)) continue;
    return OutsideSamples(coordinates[i], at[i], low, high);
  }
  if (at.size() == coordinates.size() && surface->Nearest(at) != at) {
    return Fail(Code::OutOfRange,
                PlaceText(coordinates, at) +
                    " does not lie between the samples, of whose bounds the nearest place is " +
                    PlaceText(coordinates, surface->Nearest(at)) + ": focus there and add the sample",
                {.parameter = "at"});
  }
  auto there = surface->At(at);
  if (there) there->sigma = std::hypot(there->sigma, correction_sigma.value);
  return there;
}

}  // namespace lensd::rig
