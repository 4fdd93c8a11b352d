// A picture in the making: SVG elements whose colours come from the page's style sheet, so that it turns dark with the
// reader's screen, and the box of every text, so that a test can see that none covers another or leaves the frame.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace lensd::bench {

/// In px, y downward.
struct Box {
  double x = 0.0, y = 0.0, width = 0.0, height = 0.0;
  double right() const { return x + width; }
  double bottom() const { return y + height; }
};

bool Overlap(const Box& a, const Box& b);
bool Within(const Box& inner, const Box& outer);

/// At least as wide as the text is in the page's fonts, px.
double TextWidth(std::string_view utf8, double size);

inline constexpr double kTextSize = 12.0;    ///< px of ticks and labels
inline constexpr double kLineHeight = 15.0;  ///< px

/// The text in lines of at most that width, broken at spaces.
std::vector<std::string> WrappedText(const std::string& text, double width);

/// What is safe inside elements and attributes.
std::string Escaped(std::string_view text);

/// A number with so many digits at most, without a needless exponent.
std::string Short(double value, int digits = 3);

enum class Align { Start, Middle, End };

class Drawing {
 public:
  explicit Drawing(double width) : width_(width) {}

  /// `style` is a class of the page's style sheet. Coordinates in px.
  void Line(double x1, double y1, double x2, double y2, std::string_view style);
  void Path(const std::string& d, std::string_view style);
  void Rect(const Box& box, std::string_view style, std::string_view tip = {});
  /// `y` is the line's middle. Its box is kept.
  void Text(double x, double y, const std::string& text, Align align = Align::Start, std::string_view style = "t");
  /// The mark of a series: its shape as well as its colour tells it. `tip` shows under the pointer.
  void Mark(double x, double y, int series, std::string_view tip);
  /// The box that Text() would keep.
  static Box TextBox(double x, double y, const std::string& text, Align align);

  void SetHeight(double height) { height_ = height; }
  double width() const { return width_; }
  double height() const { return height_; }
  const std::vector<Box>& texts() const { return texts_; }
  Box frame() const { return {0.0, 0.0, width_, height_}; }

  /// The whole <svg> element; `about` is read out instead of it.
  std::string Svg(const std::string& about) const;

 private:
  double width_, height_ = 0.0;
  std::string body_;
  std::vector<Box> texts_;
};

inline constexpr double kMarkRadius = 5.0;
inline constexpr int kSeries = 6;

}  // namespace lensd::bench
