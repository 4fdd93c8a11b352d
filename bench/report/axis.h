// From values to px, and which values are written beside an axis.
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bench/report/chart.h"

namespace lensd::bench {

/// An axis whose ends are known, laid over px.
class Scale {
 public:
  /// Ends that `axis` does not give enclose `values`, with some room; values that are not finite, or not above 0 on a
  /// logarithmic axis, do not count.
  Scale(const ChartAxis& axis, std::span<const double> values);
  /// `at_low` and `at_high`: where the ends lie, px.
  void Lay(double at_low, double at_high);

  /// Beyond the ends: at the ends.
  double Px(double value) const;
  bool Shows(double value) const;
  double low() const { return low_; }
  double high() const { return high_; }
  /// Round values and their texts, as many as have room at `spacing` px each.
  std::vector<std::pair<double, std::string>> Ticks(double spacing) const;

 private:
  double Along(double value) const;

  bool log_;
  double low_, high_;
  double at_low_ = 0.0, at_high_ = 1.0;
  std::vector<std::pair<double, std::string>> own_;
};

}  // namespace lensd::bench
