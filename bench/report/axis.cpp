// Scales and ticks.
#include "bench/report/axis.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lensd::bench {
namespace {

std::string TickText(double value) {
  if (std::abs(value) < 1e-3 || std::abs(value) >= 1e6) {
    if (value == 0.0) return "0";
    // Powers of ten as such: 1e-12 is easier to read than twelve zeros.
    char text[32];
    std::snprintf(text, sizeof text, "%.3g", value);
    return text;
  }
  return Short(value, 6);
}

}  // namespace

Scale::Scale(const ChartAxis& axis, std::span<const double> values)
    : log_(axis.log), low_(std::numeric_limits<double>::infinity()), high_(-low_), own_(axis.ticks) {
  for (const double value : values) {
    if (!std::isfinite(value) || (log_ && value <= 0.0)) continue;
    low_ = std::min(low_, value);
    high_ = std::max(high_, value);
  }
  if (low_ > high_) low_ = high_ = 1.0;
  if (log_) {
    const double room = std::max(1.15, std::pow(high_ / low_, 0.06));
    low_ = axis.low.value_or(low_ / room);
    high_ = axis.high.value_or(high_ * room);
  } else {
    const double room = high_ > low_ ? 0.06 * (high_ - low_) : 0.5;
    low_ = axis.low.value_or(low_ - room);
    high_ = axis.high.value_or(high_ + room);
  }
}

void Scale::Lay(double at_low, double at_high) {
  at_low_ = at_low;
  at_high_ = at_high;
}

double Scale::Along(double value) const {
  if (log_) return std::log(std::max(value, 1e-300) / low_) / std::log(high_ / low_);
  return (value - low_) / (high_ - low_);
}

double Scale::Px(double value) const {
  const double along = std::isnan(value) ? 0.0 : std::clamp(Along(value), 0.0, 1.0);
  return at_low_ + along * (at_high_ - at_low_);
}

bool Scale::Shows(double value) const {
  return std::isfinite(value) && Along(value) >= -1e-9 && Along(value) <= 1.0 + 1e-9;
}

std::vector<std::pair<double, std::string>> Scale::Ticks(double spacing) const {
  if (!own_.empty()) return own_;
  const double most = std::max(2.0, std::abs(at_high_ - at_low_) / spacing);
  std::vector<std::pair<double, std::string>> ticks;
  const auto add = [&](double value) {
    if (Shows(value)) ticks.emplace_back(value, TickText(value));
  };
  if (log_ && high_ / low_ > 8.0) {
    const int first = static_cast<int>(std::ceil(std::log10(low_) - 1e-9));
    const int last = static_cast<int>(std::floor(std::log10(high_) + 1e-9));
    const int every = std::max(1, static_cast<int>(std::ceil((last - first + 1) / most)));
    const bool fine = 3 * (last - first + 1) <= most;
    for (int power = first - 1; power <= last; ++power) {
      if (every > 1 && (power - first) % every != 0) continue;
      for (const double digit : {1.0, 2.0, 5.0}) {
        if (digit == 1.0 || fine) add(digit * std::pow(10.0, power));
      }
    }
    return ticks;
  }
  const double raw = (high_ - low_) / most;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  double step = 10.0 * power;
  for (const double digit : {1.0, 2.0, 5.0}) {
    if (digit * power >= raw) {
      step = digit * power;
      break;
    }
  }
  for (double i = std::ceil(low_ / step - 1e-9); i * step <= high_ * (1 + 1e-12) + 1e-12 * step; i += 1.0)
    add(i * step);
  return ticks;
}

}  // namespace lensd::bench
