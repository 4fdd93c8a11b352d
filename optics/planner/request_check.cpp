// Everything a request may get wrong, in the order a user would notice it; what passes here the solvers take for
// granted. Whether a depth lies inside the focal length is decided exactly where doubles cannot.
#include "optics/planner/request_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "optics/planner/limit_names.h"
#include "optics/planner/solve_exact.h"

namespace lensd::optics {

namespace {

using Problem = std::optional<Error>;

Problem Bad(std::string message, ErrorFacts facts) {
  return Fail(Code::InvalidArgument, std::move(message), std::move(facts)).error();
}

/// The same problem of a part of what `path` leads to.
Problem In(const std::string& path, const Error& error) {
  ErrorFacts facts = error.facts ? *error.facts : ErrorFacts{};
  facts.parameter = facts.parameter.empty() ? path : path + "." + facts.parameter;
  return Fail(error.code, error.message, std::move(facts)).error();
}

std::string Element(const char* list, std::size_t index) {
  return std::string(list) + "[" + std::to_string(index) + "]";
}

std::string Text(const Number& number) {
  return number.decimal.empty() ? std::to_string(number.value) : number.decimal;
}

bool Positive(const Number& number) {
  return std::isfinite(number.value) && number.value > 0.0;
}

std::string Millimetres(double metres) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.6g mm", metres * 1e3);
  return text.data();
}

bool AtInfinity(const PlanDepth& depth) {
  return !depth.is_vergence && std::isinf(depth.number.value);
}

/// Whether the depth is at or inside the focal length; a liquid lens' own changes with the plane it focuses on.
bool ReachesFocalLength(const PlanRequest& request, const PlanDepth& depth) {
  if (request.liquid || AtInfinity(depth)) return false;
  const Number& focal_length = request.focal_length;
  const double value = depth.number.value,
               power = depth.is_vergence ? focal_length.value * value : focal_length.value / value;
  constexpr double kRounding = 1e-12;
  if (std::abs(power - 1.0) > kRounding) return power > 1.0;
  return CompareFocalPower(focal_length, depth) >= 0;
}

Problem CheckDepth(const PlanDepth& depth, const std::string& what, bool may_be_past_infinity) {
  const double value = depth.number.value;
  if (std::isnan(value)) return Bad(what + ": the depth is not a number", {});
  if (!depth.is_vergence && !(value > 0.0))
    return Bad(what + ": a distance must be above zero, it is measured from the lens centre", {});
  if (depth.is_vergence && !std::isfinite(value)) return Bad(what + ": a vergence must be finite; infinity is 0 D", {});
  if (depth.is_vergence && value < 0.0 && !may_be_past_infinity) {
    return Bad(what + ": nothing can be seen past infinity; a subject's vergence is 0 D or more",
               {.minimum = 0.0, .unit = "D"});
  }
  return std::nullopt;
}

Problem CheckLens(const PlanRequest& request) {
  if (!Positive(request.focal_length))
    return Bad("the focal length must be a length above zero", {.parameter = "focalLengthMm"});
  if (!Positive(request.pupil_factor))
    return Bad("the pupil factor must be above zero; 1 is a symmetric lens", {.parameter = "pupilFactor"});
  const char* const aperture = request.apertures_are_diameters ? "aperture diameters" : "f-numbers";
  if (request.stops.empty()) {
    if (!Positive(request.f_numbers.low) || !Positive(request.f_numbers.high))
      return Bad(std::string(aperture) + " must be above zero and finite",
                 {.parameter = Positive(request.f_numbers.low) ? "apertureMax" : "apertureMin"});
    if (request.f_numbers.low.value > request.f_numbers.high.value)
      return Bad(std::string("the range of ") + aperture + " is empty: its low end is above its high end",
                 {.parameter = "apertureMin"});
  }
  for (std::size_t i = 0; i < request.stops.size(); ++i) {
    if (!Positive(request.stops[i]))
      return Bad(std::string(aperture) + " must be above zero and finite", {.parameter = Element("stops", i)});
  }
  const double low = request.extensions.low.value, high = request.extensions.high.value;
  if (!std::isfinite(low) || !std::isfinite(high)) return Bad("the extension's ends must be finite lengths", {});
  if (low > high)
    return Bad("the extension range is empty: its low end is above its high end", {.parameter = "extensionMinMm"});
  const double least = -request.focal_length.value * std::min(1.0, request.pupil_factor.value);
  if (!(low > least))
    return Bad("the extension's low end must be above " + Millimetres(least) + ": the sensor stays behind the lens",
               {.parameter = "extensionMinMm"});
  return std::nullopt;
}

Problem CheckLiquid(const PlanRequest& request) {
  if (!request.liquid) return std::nullopt;
  const auto refuse = [](const char* what, const char* parameter) {
    return Fail(Code::Unsupported, std::string("a liquid lens cannot be planned with ") + what,
                {.parameter = parameter})
        .error();
  };
  if (request.wavelength) return refuse("diffraction", "wavelengthNm");
  if (request.pupil_factor.value != 1.0) return refuse("a pupil factor other than 1", "pupilFactor");
  return std::nullopt;
}

Problem CheckTolerances(const PlanRequest& request) {
  const double delta = request.sensor_tolerance.value, epsilon = request.f_number_tolerance.value;
  if (!std::isfinite(delta) || delta < 0.0)
    return Bad("the sensor tolerance must be a length of zero or more",
               {.parameter = "sensorToleranceUm", .minimum = 0.0, .unit = "um"});
  if (!(delta < request.focal_length.value + request.extensions.low.value))
    return Bad("the sensor tolerance reaches the lens: it must be smaller than the sensor distance",
               {.parameter = "sensorToleranceUm"});
  if (!(epsilon >= 0.0 && epsilon < 1.0))
    return Bad("the f-number tolerance must be a ratio from 0 to below 1", {.parameter = "fNumberTolerance"});
  if (request.wavelength && !Positive(*request.wavelength))
    return Bad("the wavelength must be a length above zero", {.parameter = "wavelengthNm"});
  if (request.model_tolerance && !(request.model_tolerance->value > 0.0))
    return Bad("the model tolerance must be a length above zero", {.parameter = "modelToleranceUm"});
  if (request.pixel && !(request.pixel->value > 0.0))
    return Bad("the pixel must be a length above zero", {.parameter = "pixelUm"});
  return std::nullopt;
}

Problem CheckFocus(const PlanRequest& request) {
  if (request.focus) {
    if (Problem problem = CheckDepth(*request.focus, "focus", true)) return In("focus", *problem);
    if (ReachesFocalLength(request, *request.focus)) {
      const double f = request.focal_length.value, e = request.extensions.high.value;
      const std::string closest = e > 0.0 ? "the closest focus is " + Millimetres(f + f * f / e)
                                          : std::string("this lens focuses at infinity and past it only");
      return Fail(Code::OutOfRange,
                  "focus: nothing at or inside the focal length of " + Millimetres(f) + " can be focused; " + closest,
                  {.parameter = "focus"})
          .error();
    }
  }
  if (request.objective != Objective::Depth) return std::nullopt;
  if (!request.focus || !request.depth_limit)
    return Bad("the objective depth needs a focus and a blur limit", {.parameter = "objective"});
  if (!Positive(*request.depth_limit))
    return Bad("the blur limit must be a length above zero", {.parameter = "blurLimitUm"});
  return std::nullopt;
}

Problem CheckLimitDepth(const PlanRequest& request, const BlurLimit& limit, const PlanDepth& depth) {
  if (Problem problem = CheckDepth(depth, limit.name, false)) return problem;
  if (limit.kind == LimitKind::Sharp && ReachesFocalLength(request, depth)) {
    return Error{Code::OutOfRange, limit.name + ": nothing at or inside the focal length of " +
                                       Millimetres(request.focal_length.value) +
                                       " can be sharp; move its near end out"};
  }
  const double f = request.focal_length.value, p = request.pupil_factor.value;
  if (!(1.0 + f * depth.vergence().value * (1.0 / p - 1.0) > 0.0)) {
    return Error{Code::OutOfRange, limit.name + ": its near end reaches the entrance pupil of this lens"};
  }
  return std::nullopt;
}

Problem CheckLimit(const PlanRequest& request, const BlurLimit& limit) {
  if (!Positive(limit.limit))
    return Bad(limit.name + ": the blur limit must be a length above zero, not " + Text(limit.limit),
               {.parameter = "limitUm"});
  if (limit.depths.empty()) return Bad(limit.name + ": there are no depths to hold it at", {.parameter = "depths"});
  for (std::size_t i = 0; i < limit.depths.size(); ++i) {
    const DepthInterval& interval = limit.depths[i];
    if (Problem problem = CheckLimitDepth(request, limit, interval.one_end))
      return In(Element("depths", i) + ".oneEnd", *problem);
    if (Problem problem = CheckLimitDepth(request, limit, interval.other_end))
      return In(Element("depths", i) + ".otherEnd", *problem);
  }
  return std::nullopt;
}

}  // namespace

std::optional<Error> CheckSetting(const PlanRequest& request) {
  for (const auto check : {CheckLens, CheckLiquid, CheckTolerances, CheckFocus}) {
    if (Problem problem = check(request)) return problem;
  }
  return std::nullopt;
}

std::optional<Error> CheckLimits(const PlanRequest& request) {
  LimitNames names(request.limits);
  for (std::size_t i = 0; i < request.limits.size(); ++i) {
    const BlurLimit& limit = request.limits[i];
    if (Problem problem = CheckLimit(request, limit)) return In(Element("limits", i), *problem);
    if (!names.Take(i))
      return Bad(limit.name + ": this name is taken; every limit needs its own",
                 {.parameter = Element("limits", i) + ".name"});
  }
  return std::nullopt;
}

std::optional<Error> Check(const PlanRequest& request) {
  if (Problem problem = CheckSetting(request)) return problem;
  return CheckLimits(request);
}

}  // namespace lensd::optics
