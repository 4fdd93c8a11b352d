// Axes of a chart: which numbers get a tick and where a value lies in pixels. Ranges come from the data unless given; a
// logarithmic axis takes positive values only.
#include "svg_axis.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace lensd::io {
namespace {

/// The nice step (1, 2, 2.5 or 5 times a power of ten) that gives at most `wanted` intervals.
double NiceStep(double span, int wanted) {
  const double raw = span / std::max(wanted, 1);
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 2.5, 5.0}) {
    if (factor * power >= raw * (1.0 - 1e-9)) return factor * power;
  }
  return 10.0 * power;
}

constexpr int kUsualTicks = 7;
constexpr double kLargest = 1e100;  // data beyond do not widen an axis, so that ticks never overflow
constexpr double kSmallestRatio = 1.0 + 1e-9;

}  // namespace

std::string TickText(double value) {
  const double size = std::abs(value);
  char text[48];
  if (size != 0.0 && (size < 1e-4 || size >= 1e6)) {
    const int exponent = static_cast<int>(std::floor(std::log10(size) + 1e-9));
    const double mantissa = value / std::pow(10.0, exponent);
    static constexpr const char* kSuperscripts[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
    std::string power = exponent < 0 ? "10⁻" : "10";
    for (const char digit : std::to_string(std::abs(exponent))) power += kSuperscripts[digit - '0'];
    if (std::abs(mantissa - 1.0) < 1e-9) return power;
    std::snprintf(text, sizeof text, "%.4g·", mantissa);
    return text + power;
  }
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

AxisMap::AxisMap(const Axis& axis, std::vector<double> data) : axis_(axis) {
  const bool log = axis.scale == Scale::Log;
  std::erase_if(data, [log](double value) { return !(std::abs(value) < kLargest) || (log && value < 1.0 / kLargest); });
  const auto [least, most] = std::ranges::minmax_element(data);
  low_ = axis.low.value_or(data.empty() ? (log ? 0.1 : 0.0) : *least);
  high_ = axis.high.value_or(data.empty() ? 1.0 : *most);
  if (log) {
    if (high_ < low_ * kSmallestRatio) high_ = low_ * 2.0;
    const double margin = std::pow(high_ / low_, 0.03);
    if (!axis.low) low_ /= margin;
    if (!axis.high) high_ *= margin;
    return;
  }
  if (!(high_ > low_)) {
    const double half = low_ == 0.0 ? 0.5 : 0.05 * std::abs(low_);
    if (!axis.low || axis.high) low_ -= half;
    high_ = low_ + 2.0 * half;
  }
  const double step = NiceStep(high_ - low_, kUsualTicks);
  if (!axis.low) low_ = std::floor(low_ / step + 1e-9) * step;
  if (!axis.high) high_ = std::ceil(high_ / step - 1e-9) * step;
}

void AxisMap::SetPixels(double start, double end) {
  start_ = start;
  end_ = end;
}

double AxisMap::Pixel(double value) const {
  const double along =
      axis_.scale == Scale::Log ? std::log(value / low_) / std::log(high_ / low_) : (value - low_) / (high_ - low_);
  return start_ + along * (end_ - start_);
}

std::vector<Tick> AxisMap::Ticks(int wanted) const {
  if (axis_.ticks.empty()) return axis_.scale == Scale::Log ? LogTicks(wanted) : LinearTicks(wanted);
  std::vector<Tick> ticks;
  for (const auto& [value, label] : axis_.ticks) {
    if (value >= low_ && value <= high_) ticks.push_back({value, label});
  }
  return ticks;
}

std::vector<Tick> AxisMap::LinearTicks(int wanted) const {
  const double step = NiceStep(high_ - low_, wanted);
  std::vector<Tick> ticks;
  for (double index = std::ceil(low_ / step - 1e-9); index * step <= high_ + 1e-9 * step; ++index) {
    ticks.push_back({index * step, TickText(index == 0.0 ? 0.0 : index * step)});
  }
  return ticks;
}

std::vector<Tick> AxisMap::LogTicks(int wanted) const {
  const double decades = std::log10(high_ / low_);
  if (decades < 0.5) return LinearTicks(wanted);
  const bool between = decades * 3.0 <= wanted + 1.0;
  const int stride = std::max(1, static_cast<int>(std::ceil(decades / wanted)));
  std::vector<Tick> ticks;
  for (int power = static_cast<int>(std::floor(std::log10(low_))); std::pow(10.0, power) <= high_; ++power) {
    for (int digit = 1; digit <= 9; ++digit) {
      const double value = digit * std::pow(10.0, power);
      if (value < low_ * (1.0 - 1e-9) || value > high_ * (1.0 + 1e-9)) continue;
      const bool major = (digit == 1 && power % stride == 0) || (between && (digit == 2 || digit == 5));
      if (major || decades < 6.0) ticks.push_back({value, major ? TickText(value) : ""});
    }
  }
  return ticks;
}

}  // namespace lensd::io
