// Elements of SVG and the width of texts.
#include "bench/report/drawing.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>

namespace lensd::bench {
namespace {

std::string Number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", value);
  std::string number = text;
  if (number.ends_with(".0")) number.resize(number.size() - 2);
  return number == "-0" ? "0" : number;
}

std::string Attributes(std::initializer_list<std::pair<const char*, double>> values) {
  std::string text;
  for (const auto& [name, value] : values) text += " " + std::string(name) + "=\"" + Number(value) + "\"";
  return text;
}

/// In parts of the size: DejaVu Sans, the widest of the fonts that a page without fonts of its own may get.
double WidthOf(char c) {
  constexpr std::string_view kThin = "ijlI.,:;'|!", kNarrow = "()[]{}frt/- \"", kWide = "mwMW%@";
  if (kThin.find(c) != kThin.npos) return 0.34;
  if (kNarrow.find(c) != kNarrow.npos) return 0.43;
  if (kWide.find(c) != kWide.npos) return 0.99;
  return c >= 'A' && c <= 'Z' ? 0.74 : 0.64;
}

}  // namespace

bool Overlap(const Box& a, const Box& b) {
  return a.x < b.right() && b.x < a.right() && a.y < b.bottom() && b.y < a.bottom();
}

bool Within(const Box& inner, const Box& outer) {
  return inner.x >= outer.x && inner.y >= outer.y && inner.right() <= outer.right() && inner.bottom() <= outer.bottom();
}

double TextWidth(std::string_view utf8, double size) {
  double width = 0.0;
  for (const char c : utf8) {
    const bool continues = (static_cast<unsigned char>(c) & 0xC0) == 0x80;
    if (!continues) width += static_cast<unsigned char>(c) >= 0x80 ? 0.84 : WidthOf(c);
  }
  return width * size;
}

std::vector<std::string> WrappedText(const std::string& text, double width) {
  std::vector<std::string> lines(1);
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find(' ', at), text.size());
    const std::string word = text.substr(at, end - at);
    const std::string longer = lines.back().empty() ? word : lines.back() + " " + word;
    if (lines.back().empty() || TextWidth(longer, kTextSize) <= width)
      lines.back() = longer;
    else
      lines.push_back(word);
    at = end + 1;
  }
  return lines;
}

std::string Escaped(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '<')
      escaped += "&lt;";
    else if (c == '>')
      escaped += "&gt;";
    else if (c == '&')
      escaped += "&amp;";
    else if (c == '"')
      escaped += "&quot;";
    else
      escaped += c;
  }
  return escaped;
}

std::string Short(double value, int digits) {
  if (!std::isfinite(value)) return value < 0 ? "-∞" : "∞";
  if (value == 0.0) return "0";
  const double size = std::abs(value);
  char text[64];
  if (size >= 1e7 || size < 1e-4) {
    std::snprintf(text, sizeof text, "%.*g", digits, value);
    return text;
  }
  const int decimals = std::max(0, digits - 1 - static_cast<int>(std::floor(std::log10(size))));
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  std::string number = text;
  if (number.find('.') != std::string::npos) {
    while (number.ends_with('0')) number.pop_back();
    if (number.ends_with('.')) number.pop_back();
  }
  return number;
}

void Drawing::Line(double x1, double y1, double x2, double y2, std::string_view style) {
  body_ += "<line" + Attributes({{"x1", x1}, {"y1", y1}, {"x2", x2}, {"y2", y2}}) + " class=\"" + std::string(style) +
           "\"/>\n";
}

void Drawing::Path(const std::string& d, std::string_view style) {
  body_ += "<path d=\"" + d + "\" class=\"" + std::string(style) + "\"/>\n";
}

void Drawing::Rect(const Box& box, std::string_view style, std::string_view tip) {
  body_ += "<rect" + Attributes({{"x", box.x}, {"y", box.y}, {"width", box.width}, {"height", box.height}}) +
           " class=\"" + std::string(style) + "\"";
  body_ += tip.empty() ? "/>\n" : "><title>" + Escaped(tip) + "</title></rect>\n";
}

Box Drawing::TextBox(double x, double y, const std::string& text, Align align) {
  const double width = TextWidth(text, kTextSize);
  const double left = align == Align::Start ? x : align == Align::Middle ? x - 0.5 * width : x - width;
  return {left, y - 0.5 * kLineHeight + 0.5, width, kLineHeight - 1.0};
}

void Drawing::Text(double x, double y, const std::string& text, Align align, std::string_view style) {
  static constexpr std::array kAnchors = {"start", "middle", "end"};
  texts_.push_back(TextBox(x, y, text, align));
  body_ += "<text" + Attributes({{"x", x}, {"y", y + 0.35 * kTextSize}}) + " text-anchor=\"" +
           kAnchors[static_cast<std::size_t>(align)] + "\" class=\"" + std::string(style) + "\">" + Escaped(text) +
           "</text>\n";
}

void Drawing::Mark(double x, double y, int series, std::string_view tip) {
  const auto at = [&](double dx, double dy) {
    return Number(x + kMarkRadius * dx) + " " + Number(y + kMarkRadius * dy);
  };
  std::string d;
  switch (series % kSeries) {
    case 0:  // disk
      d = "M" + at(-1, 0) + "a5 5 0 1 0 10 0a5 5 0 1 0 -10 0Z";
      break;
    case 1:  // square
      d = "M" + at(-0.85, -0.85) + "L" + at(0.85, -0.85) + "L" + at(0.85, 0.85) + "L" + at(-0.85, 0.85) + "Z";
      break;
    case 2:  // triangle
      d = "M" + at(0, -1.1) + "L" + at(1.05, 0.8) + "L" + at(-1.05, 0.8) + "Z";
      break;
    case 3:  // diamond
      d = "M" + at(0, -1.2) + "L" + at(1.2, 0) + "L" + at(0, 1.2) + "L" + at(-1.2, 0) + "Z";
      break;
    case 4:  // triangle upside down
      d = "M" + at(0, 1.1) + "L" + at(1.05, -0.8) + "L" + at(-1.05, -0.8) + "Z";
      break;
    default:  // cross
      d = "M" + at(-1, -0.5) + "L" + at(-0.5, -1) + "L" + at(0, -0.5) + "L" + at(0.5, -1) + "L" + at(1, -0.5) + "L" +
          at(0.5, 0) + "L" + at(1, 0.5) + "L" + at(0.5, 1) + "L" + at(0, 0.5) + "L" + at(-0.5, 1) + "L" + at(-1, 0.5) +
          "L" + at(-0.5, 0) + "Z";
  }
  body_ += "<path d=\"" + d + "\" class=\"m s" + std::to_string(series % kSeries) + "\"><title>" + Escaped(tip) +
           "</title></path>\n";
}

std::string Drawing::Svg(const std::string& about) const {
  return "<svg viewBox=\"0 0 " + Number(width_) + " " + Number(height_) + "\" role=\"img\" aria-label=\"" +
         Escaped(about) + "\">\n" + body_ + "</svg>\n";
}

}  // namespace lensd::bench
