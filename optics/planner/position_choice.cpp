// Which positions of a lens a request admits.
#include <algorithm>
#include <cmath>

#include "planner/position_blur.h"

namespace lensd::optics {

namespace {

/// The entries of rising `values` in [low, high], a rounding apart; where there are none, the one nearest to it.
template <class Value>
std::vector<std::size_t> Within(std::size_t count, const Value& value, double low, double high) {
  constexpr double kRounding = 1e-9;
  const double hair = kRounding * std::max(std::abs(low), std::abs(high));
  std::vector<std::size_t> inside;
  std::size_t nearest = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (value(i) >= low - hair && value(i) <= high + hair) inside.push_back(i);
    const double middle = 0.5 * (low + high);
    if (std::abs(value(i) - middle) < std::abs(value(nearest) - middle)) nearest = i;
  }
  return inside.empty() ? std::vector{nearest} : inside;
}

std::vector<std::size_t> Openings(const PlanRequest& request, const LensPositions& lens) {
  const auto n = [&](const Number& given) {
    return request.apertures_are_diameters ? lens.focal_length.value / given.value : given.value;
  };
  const auto f_number = [&](std::size_t j) { return lens.iris[j].f_number.value; };
  if (request.stops.empty()) {
    const auto [low, high] = std::minmax({n(request.f_numbers.low), n(request.f_numbers.high)});
    return Within(lens.iris.size(), f_number, low, high);
  }
  std::vector<std::size_t> chosen;
  for (const Number& stop : request.stops) {
    chosen.push_back(Within(lens.iris.size(), f_number, n(stop), n(stop)).front());
  }
  std::ranges::sort(chosen);
  return chosen;
}

}  // namespace

PositionChoice ChoiceOf(const PlanRequest& request, const LensPositions& lens, const PositionBlur& blur) {
  PositionChoice choice{.focus = {}, .iris = Openings(request, lens)};
  const auto& focus = lens.focus;
  if (!request.focus) {
    const auto extension = [&](std::size_t i) { return focus[i].extension.value; };
    choice.focus = Within(focus.size(), extension, request.extensions.low.value, request.extensions.high.value);
    return choice;
  }
  const auto off = [&](std::size_t i) {
    return std::abs(blur.Vergence(*request.focus, focus[i]) - focus[i].focal_plane.value);
  };
  std::size_t nearest = 0;
  for (std::size_t i = 1; i < focus.size(); ++i) {
    if (off(i) < off(nearest)) nearest = i;
  }
  choice.focus = {nearest};
  double step = 0.0;
  if (nearest > 0) step = (focus[nearest].focal_plane - focus[nearest - 1].focal_plane).value;
  if (nearest + 1 < focus.size()) {
    step = std::max(step, (focus[nearest + 1].focal_plane - focus[nearest].focal_plane).value);
  }
  constexpr double kHalf = 0.5001;
  choice.focus_reachable =
      off(nearest) <= std::max(kHalf * step, blur.Bound(focus[nearest], focus[nearest].focal_plane.value));
  return choice;
}

}  // namespace lensd::optics
