// The grid cells a straight line crosses, in order.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace lensd::sim {

/// Walks from one point of the picture to another, from cell to cell.
class CellWalk {
 public:
  CellWalk(double from_x, double from_y, double to_x, double to_y) : x_(from_x, to_x), y_(from_y, to_y) {}

  int x() const { return x_.cell; }
  int y() const { return y_.cell; }
  /// Where the line leaves the present cell: 0 at its beginning, 1 at its end.
  double Until() const { return std::min(std::min(x_.next, y_.next), 1.0); }
  /// Whether the line ends in the present cell.
  bool AtEnd() const { return Until() >= 1.0; }
  void Advance() { (x_.next <= y_.next ? x_ : y_).Advance(); }

 private:
  struct Axis {
    int cell;
    int step;
    double next;   ///< parameter at the next boundary
    double every;  ///< between boundaries

    Axis(double from, double to) : cell(static_cast<int>(std::floor(from))), step(to > from ? 1 : -1) {
      const double length = std::abs(to - from);
      every = length > 0.0 ? 1.0 / length : std::numeric_limits<double>::infinity();
      next = length > 0.0 ? std::abs((step > 0 ? cell + 1 : cell) - from) * every : every;
    }
    void Advance() {
      cell += step;
      next += every;
    }
  };
  Axis x_;
  Axis y_;
};

}  // namespace lensd::sim
