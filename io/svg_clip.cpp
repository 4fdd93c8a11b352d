// Lines and polygons cut to the frame of a chart, since some viewers fail on coordinates far outside of it.
#include "svg_clip.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lensd::io {
namespace {

/// A side of the box as a half-plane: distance >= 0 is inside.
double Inside(const Box& box, int side, const Pixel& at) {
  switch (side) {
    case 0:
      return at.x - box.left;
    case 1:
      return box.right - at.x;
    case 2:
      return at.y - box.top;
    default:
      return box.bottom - at.y;
  }
}

Pixel Between(const Pixel& a, const Pixel& b, double part) {
  return {a.x + part * (b.x - a.x), a.y + part * (b.y - a.y)};
}

}  // namespace

std::optional<std::pair<Pixel, Pixel>> ClipSegment(const Box& box, Pixel from, Pixel to) {
  if (!std::isfinite(from.x + from.y + to.x + to.y)) return std::nullopt;
  double start = 0.0, end = 1.0;
  for (int side = 0; side < 4; ++side) {
    const double a = Inside(box, side, from), b = Inside(box, side, to);
    if (a < 0.0 && b < 0.0) return std::nullopt;
    if (a < 0.0) start = std::max(start, a / (a - b));
    if (b < 0.0) end = std::min(end, a / (a - b));
  }
  if (start > end) return std::nullopt;
  return std::pair{Between(from, to, start), Between(from, to, end)};
}

/// Cuts the polygon by one side of the box after another (Sutherland and Hodgman).
std::vector<Pixel> ClipPolygon(const Box& box, std::vector<Pixel> corners) {
  for (int side = 0; side < 4; ++side) {
    std::vector<Pixel> kept;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Pixel& from = corners[i];
      const Pixel& to = corners[(i + 1) % corners.size()];
      const double a = Inside(box, side, from), b = Inside(box, side, to);
      if (a >= 0.0) kept.push_back(from);
      if ((a < 0.0) != (b < 0.0)) kept.push_back(Between(from, to, a / (a - b)));
    }
    corners = std::move(kept);
  }
  return corners;
}

}  // namespace lensd::io
