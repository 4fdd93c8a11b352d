// One way to write a number for people, so that messages, tables and errors agree.
#include "base/quantity_text.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace lensd {

std::string Short(double value, int digits) {
  if (std::isnan(value)) return "?";
  if (std::isinf(value)) return value > 0.0 ? "infinity" : "-infinity";
  const double size = std::abs(value);
  constexpr int kMostDecimals = 6;
  if (size < 0.5e-6) return "0";
  const int places = std::min(digits, 6);
  const int magnitude = static_cast<int>(std::floor(std::log10(size)));
  char text[64];
  if (magnitude >= 15) {
    std::snprintf(text, sizeof text, "%.*g", places, value);
    return text;
  }
  if (magnitude >= 6) {
    const double scale = std::pow(10.0, magnitude - 5);
    std::snprintf(text, sizeof text, "%.0f", std::round(value / scale) * scale);
    return text;
  }
  std::snprintf(text, sizeof text, "%.*f", std::clamp(places - 1 - magnitude, 0, kMostDecimals), value);
  std::string written = text;
  if (written.find('.') != std::string::npos) {
    written.erase(written.find_last_not_of('0') + 1);
    if (written.back() == '.') written.pop_back();
  }
  return written;
}

std::string LengthText(Metres length, int digits) {
  const double size = std::abs(length.value);
  if (size >= 1e5) return Short(length.value / 1e3, digits) + " km";
  if (size >= 1.0) return Short(length.value, digits) + " m";
  if (size >= 1e-3 || size == 0.0) return Short(length.value * 1e3, digits) + " mm";
  return Short(length.value * 1e6, digits) + " um";
}

}  // namespace lensd
