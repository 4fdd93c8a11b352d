// Every slice has an error bar. A limit is judged by all bars of its slices together: one that lies beyond the limit as
// a whole breaks it, and all must end before a tenth beyond it for the limit to hold.
#include "verify/limit_verdict.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lensd::verify {

std::string_view NameOf(Answer answer) {
  switch (answer) {
    case Answer::Holds:
      return "holds";
    case Answer::Broken:
      return "broken";
    case Answer::CannotTell:
      break;
  }
  return "cannot tell";
}

Result<std::vector<double>> SliceEdges(std::span<const float> depth_m, std::span<const BlurLimit> limits,
                                       double slice_m) {
  double nearest = std::numeric_limits<double>::infinity(), farthest = 0.0;
  for (const float metres : depth_m) {
    if (!(metres > 0)) continue;
    nearest = std::min<double>(nearest, metres);
    farthest = std::max<double>(farthest, metres);
  }
  if (farthest == 0.0) return Fail(Code::BadData, "no pixel of the depth map has a known depth");
  constexpr double kBeyond_m = 1e-6;  // the farthest pixel lies in the last slice, whose far edge does not belong to it
  std::vector<double> ends = {nearest, farthest + kBeyond_m};
  for (const BlurLimit& limit : limits) {
    for (const double end : {limit.near_m, limit.far_m}) {
      if (end > nearest && end < farthest) ends.push_back(end);
    }
  }
  std::sort(ends.begin(), ends.end());
  std::vector<double> edges;
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
    const double wide = ends[i + 1] - ends[i];
    const double wanted = std::max(1.0, std::round(wide / slice_m));
    if (static_cast<double>(edges.size()) + wanted > static_cast<double>(kMostSlices)) {
      return Fail(Code::InvalidArgument, "the depths from " + std::to_string(nearest) + " m to " +
                                             std::to_string(farthest) + " m make more than " +
                                             std::to_string(kMostSlices) + " slices; take thicker ones");
    }
    const int parts = static_cast<int>(wanted);
    for (int part = 0; part < parts; ++part) edges.push_back(ends[i] + wide * part / parts);
  }
  edges.push_back(ends.back());
  return edges;
}

Verdict Judge(const BlurLimit& limit, std::span<const SliceBlur> slices) {
  constexpr double kReach = 0.1;  // of the limit
  const bool sharp = limit.kind == BlurLimit::Kind::Sharp;
  Verdict verdict{.limit = limit};
  double worst = -std::numeric_limits<double>::infinity();
  bool broken = false, all_within = true;
  for (const SliceBlur& slice : slices) {
    const double middle = 0.5 * (slice.near_m + slice.far_m);
    if (slice.pixels < kFewestPixels || middle < limit.near_m || middle > limit.far_m) continue;
    verdict.pixels += slice.pixels;
    broken |= sharp ? slice.low_px > limit.limit_px : !slice.open && slice.high_px < limit.limit_px;
    all_within &= sharp ? !slice.open && slice.high_px <= (1 + kReach) * limit.limit_px
                        : slice.low_px >= (1 - kReach) * limit.limit_px;
    const double excess = (sharp ? 1 : -1) * (slice.diameter_px - limit.limit_px);
    if (excess <= worst) continue;
    worst = excess;
    verdict.worst = slice;
  }
  if (broken) {
    verdict.answer = Answer::Broken;
  } else if (verdict.worst && all_within) {
    verdict.answer = Answer::Holds;
  }
  return verdict;
}

}  // namespace lensd::verify
