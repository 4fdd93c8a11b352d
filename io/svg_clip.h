// Pixels: rectangles, and lines and polygons cut to them, so that no coordinate in the file is far outside the frame.
#pragma once

#include <optional>
#include <utility>
#include <vector>

namespace lensd::io {

struct Pixel {
  double x = 0.0, y = 0.0;
};

struct Box {
  double left = 0.0, top = 0.0, right = 0.0, bottom = 0.0;

  bool Holds(const Box& other) const {
    return left <= other.left && right >= other.right && top <= other.top && bottom >= other.bottom;
  }
};

/// The part of the segment inside the box; nullopt where there is none or an end is not finite.
std::optional<std::pair<Pixel, Pixel>> ClipSegment(const Box& box, Pixel from, Pixel to);

/// The part of the polygon inside the box; empty where there is none.
std::vector<Pixel> ClipPolygon(const Box& box, std::vector<Pixel> corners);

}  // namespace lensd::io
