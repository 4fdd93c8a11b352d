// Wishes of a plan against what the lens has.
#include "planning/plan_reach.h"

#include <algorithm>
#include <iomanip>
#include <sstream>
#include <string>
#include <utility>

namespace lensd::daemon {
namespace {

/// Marked f-numbers are rounded: f/11 is f/11.31.
constexpr double kMarked = 1.03;

std::string Rounded(double value) {
  std::ostringstream text;
  text << std::setprecision(4) << value;
  return text.str();
}

/// OutOfRange, where apertures are asked for of which the lens has none.
Result<void> CheckApertures(const optics::PlanRequest& asked, const optics::LensPositions& lens) {
  const auto [least, most] = std::ranges::minmax(lens.iris, {}, &optics::IrisPosition::f_number);
  const bool diameters = asked.apertures_are_diameters;
  const double f = lens.focal_length.value;
  const auto f_number = [&](const optics::Number& given) { return diameters ? f / given.value : given.value; };
  const auto outside = [&](double low, double high) {
    return high * kMarked < least.f_number.value || low > most.f_number.value * kMarked;
  };
  const auto refuse = [&](std::string parameter) -> Result<void> {
    const double low = diameters ? 1e3 * f / most.f_number.value : least.f_number.value;
    const double high = diameters ? 1e3 * f / least.f_number.value : most.f_number.value;
    const std::string what = diameters ? "mm of aperture" : "f-numbers";
    return Fail(Code::OutOfRange,
                "this lens has " + Rounded(low) + " to " + Rounded(high) + " " + what + ", and others are asked for",
                {.parameter = std::move(parameter), .minimum = low, .maximum = high, .unit = diameters ? "mm" : ""});
  };
  const auto is_aperture = [](const optics::Number& given) { return given.value > 0.0; };
  const bool sensible = asked.stops.empty() ? is_aperture(asked.f_numbers.low) && is_aperture(asked.f_numbers.high)
                                            : std::ranges::all_of(asked.stops, is_aperture);
  if (!sensible) return {};  // the planner says so
  for (std::size_t i = 0; i < asked.stops.size(); ++i) {
    const double stop = f_number(asked.stops[i]);
    if (outside(stop, stop)) return refuse("request.stops[" + std::to_string(i) + "]");
  }
  if (!asked.stops.empty()) return {};
  const auto [low, high] = std::minmax({f_number(asked.f_numbers.low), f_number(asked.f_numbers.high)});
  if (!outside(low, high)) return {};
  const bool too_small = low > most.f_number.value;  // openings, that is: large f-numbers
  return refuse(too_small != diameters ? "request.apertureMin" : "request.apertureMax");
}

/// OutOfRange, where all extensions asked for lie beyond the lens' own.
Result<void> CheckExtensions(const optics::PlanRequest& asked, const optics::LensPositions& lens) {
  const double least = lens.focus.front().extension.value, most = lens.focus.back().extension.value;
  const auto [low, high] = std::minmax(least, most);
  const double room = lens.focus.size() > 1 ? (high - low) / static_cast<double>(lens.focus.size() - 1) : 1e-6;
  const bool above = asked.extensions.low.value > high + room, below = asked.extensions.high.value < low - room;
  if (!above && !below) return {};
  return Fail(Code::OutOfRange,
              "the extension of this lens is " + Rounded(1e3 * low) + " to " + Rounded(1e3 * high) +
                  " mm, and another is asked for",
              {.parameter = above ? "request.extensionMinMm" : "request.extensionMaxMm",
               .minimum = 1e3 * low,
               .maximum = 1e3 * high,
               .unit = "mm"});
}

}  // namespace

Result<void> CheckReach(const optics::PlanRequest& asked, const optics::LensPositions& lens, Zoomed zoomed) {
  const bool judged = !asked.apertures_are_diameters || zoomed == Zoomed::No;
  if (!judged) return {};
  if (auto apertures = CheckApertures(asked, lens); !apertures) return apertures;
  if (lens.liquid || asked.focus) return {};
  return CheckExtensions(asked, lens);
}

}  // namespace lensd::daemon
