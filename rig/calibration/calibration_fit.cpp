// A focus curve from measured points, with the error it may have: left-out points, scatter, half a step.
#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "optics/conjugates.h"
#include "rig/calibration.h"
#include "rig/calibration/curve.h"

namespace lensd::rig {
namespace {

constexpr std::size_t kLeastDepths = 4;  // that an error can be told from

struct Depth {
  FocusPoint mean;
  double extension = 0.0;
  double scatter = 0.0;  ///< native units: farthest from the mean
};

std::string DepthText(const FocusPoint& point) {
  std::ostringstream text;
  if (point.extension) {
    text << point.extension->value * 1e3 << " mm of extension";
  } else {
    text << point.vergence->value << " D";
  }
  return text.str();
}

/// Points of one depth become one, in the order of positions.
std::vector<Depth> Grouped(const std::vector<FocusPoint>& points, Metres focal_length) {
  std::vector<Depth> depths;
  std::vector<std::vector<double>> positions;
  for (const FocusPoint& point : points) {
    const auto same = std::ranges::find_if(depths, [&](const Depth& depth) {
      return depth.mean.extension == point.extension && depth.mean.vergence == point.vergence;
    });
    const auto at = static_cast<std::size_t>(same - depths.begin());
    if (same == depths.end()) {
      const Metres extension = point.extension ? *point.extension : optics::Extension(focal_length, *point.vergence);
      depths.push_back({point, extension.value, 0.0});
      positions.emplace_back();
    }
    positions[at].push_back(point.position.value);
  }
  for (std::size_t i = 0; i < depths.size(); ++i) {
    double mean = 0.0;
    for (const double position : positions[i]) mean += position / static_cast<double>(positions[i].size());
    for (const double position : positions[i])
      depths[i].scatter = std::max(depths[i].scatter, std::abs(position - mean));
    depths[i].mean.position = Native{mean};
  }
  std::ranges::sort(depths, {}, [](const Depth& depth) { return depth.mean.position; });
  return depths;
}

/// The worst of: a depth against the curve through all others; the scatter of one depth; half a step.
Result<double> ErrorOf(const std::vector<Depth>& depths, double resolution) {
  double worst = 0.0, scatter = 0.5 * resolution, steepest = 0.0;
  for (std::size_t left_out = 0; left_out < depths.size(); ++left_out) {
    scatter = std::max(scatter, depths[left_out].scatter);
    if (left_out > 0) {
      const double rise = depths[left_out].extension - depths[left_out - 1].extension;
      const double run = (depths[left_out].mean.position - depths[left_out - 1].mean.position).value;
      steepest = std::max(steepest, std::abs(rise / run));
    }
    if (left_out == 0 || left_out + 1 == depths.size()) continue;
    std::vector<Curve::Knot> others;
    for (std::size_t i = 0; i < depths.size(); ++i) {
      if (i != left_out) others.push_back({depths[i].mean.position.value, depths[i].extension});
    }
    const auto curve = Curve::Through(others);
    if (!curve) return PassOn(curve);
    worst = std::max(worst, std::abs(curve->At(depths[left_out].mean.position.value) - depths[left_out].extension));
  }
  return worst + scatter * steepest;
}

}  // namespace

Result<FocusCurve> FitFocusCurve(std::vector<FocusPoint> points, Metres focal_length, std::optional<Metres> error,
                                 double resolution) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    const FocusPoint& point = points[i];
    const ErrorFacts facts{.parameter = "points[" + std::to_string(i) + "]"};
    if (point.extension.has_value() == point.vergence.has_value()) {
      return Fail(Code::InvalidArgument, "a point of a calibration has exactly one depth", facts);
    }
    if (point.vergence && !(point.vergence->value * focal_length.value < 1.0)) {
      return Fail(Code::InvalidArgument, "a target inside the focal length cannot be in focus", facts);
    }
  }
  const std::vector<Depth> depths = Grouped(points, focal_length);
  if (depths.size() < 2) return Fail(Code::InvalidArgument, "a calibration needs targets at two depths at least");
  const bool rising = depths.back().extension > depths.front().extension;
  for (std::size_t i = 1; i < depths.size(); ++i) {
    const double rise = depths[i].extension - depths[i - 1].extension;
    if (!(depths[i - 1].mean.position < depths[i].mean.position) || !(rising ? rise > 0.0 : rise < 0.0)) {
      return Fail(Code::InvalidArgument, "the points at " + DepthText(depths[i - 1].mean) + " and " +
                                             DepthText(depths[i].mean) +
                                             " are out of order: one of them was not in focus, or its depth is wrong");
    }
  }
  FocusCurve curve;
  curve.focal_length = focal_length;
  for (const Depth& depth : depths) curve.points.push_back(depth.mean);
  if (error) {
    curve.error = *error;
    return curve;
  }
  if (depths.size() < kLeastDepths) {
    return Fail(Code::InvalidArgument,
                "say how large the error is: it can be estimated from four depths or more, and here are " +
                    std::to_string(depths.size()));
  }
  const auto estimated = ErrorOf(depths, resolution);
  if (!estimated) return PassOn(estimated);
  curve.error = Metres{*estimated};
  return curve;
}

}  // namespace lensd::rig
