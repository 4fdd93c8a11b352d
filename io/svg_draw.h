// SVG elements as text, and where labels find room.
#pragma once

#include <string>
#include <vector>

#include "io/svg.h"
#include "svg_clip.h"

namespace lensd::io {

inline constexpr double kTextPx = 12.5;
inline constexpr const char* kInk = "#222222";

struct TextStyle {
  double size = kTextPx;
  std::string colour = kInk;
  const char* anchor = "start";  // or "middle", "end"
  bool bold = false;
  bool halo = false;    // a white rim, to stay readable over lines
  double rotate = 0.0;  // degrees around the anchor
};

/// A coordinate with two decimals.
std::string Number(double value);
/// At least as wide as the text is in DejaVu Sans, the widest of the fonts that viewers take.
double TextWidth(const std::string& text, double size = kTextPx);
/// The paragraphs in lines of at most that width, broken at spaces; a longer word has a line of its own.
std::vector<std::string> BrokenLines(const std::vector<std::string>& paragraphs, double width);
std::string DrawText(Pixel at, const std::string& text, const TextStyle& style = {});
std::string DrawLine(Pixel a, Pixel b, const std::string& colour, double width, bool dashed = false);
/// `tip` shows under the pointer.
std::string DrawMarker(Pixel at, Marker marker, double size, const std::string& colour, const std::string& tip = {});
/// A closed or an empty element, "<circle .../>\n", with this tip.
std::string WithTip(std::string element, const std::string& tip);
/// `corners` as "x,y x,y".
std::string PointList(const std::vector<Pixel>& corners);

/// A label and the places it may take: anchors of its text, best first.
struct Label {
  std::string text;
  std::string colour;
  struct Place {
    Pixel at;
    const char* anchor;
    bool led = true;  // so far off that a leader, where there is one, is needed
  };
  std::vector<Place> places;
  std::optional<Pixel> leader = {};  // a thin line from the text to here
  bool bold = false;
};

/// Places labels one after another where they cover least of each other and of what was blocked before.
class LabelPlacer {
 public:
  explicit LabelPlacer(Box frame) : frame_(frame) {}
  /// What a label must not cover, and lines, which it may where there is no other room.
  void Block(const Box& box) { taken_.push_back(box); }
  void BlockLine(const Box& box) { lines_.push_back(box); }
  std::string Place(const Label& label);
  /// Some label covers another, or a mark, or leaves the frame.
  bool crowded() const { return crowded_; }

 private:
  double Covered(const Box& box) const;
  double Cost(const Box& box) const;

  Box frame_;
  std::vector<Box> taken_, lines_;
  bool crowded_ = false;
};

}  // namespace lensd::io
