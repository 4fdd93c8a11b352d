// From numbers on an axis to pixels and ticks.
#pragma once

#include <string>
#include <vector>

#include "io/svg.h"

namespace lensd::io {

struct Tick {
  double value = 0.0;
  std::string label;  ///< empty: a minor tick
};

/// An axis with its ends settled. `start` and `end` are px of low and high.
class AxisMap {
 public:
  AxisMap(const Axis& axis, std::vector<double> data);

  void SetPixels(double start, double end);
  /// Pixels of a value; not finite where the value has no place on this axis.
  double Pixel(double value) const;
  double low() const { return low_; }
  double high() const { return high_; }
  /// Major and minor ticks in [low, high], about `wanted` major ones.
  std::vector<Tick> Ticks(int wanted) const;

 private:
  std::vector<Tick> LogTicks(int wanted) const;
  std::vector<Tick> LinearTicks(int wanted) const;

  Axis axis_;
  double low_ = 0.0, high_ = 1.0;
  double start_ = 0.0, end_ = 1.0;
};

/// A number as short as it can be said: 0.25, 1200, 10⁻⁵.
std::string TickText(double value);

}  // namespace lensd::io
