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
std::string Escaped(const std::string& text);
/// An estimate that errs toward too wide.
double TextWidth(const std::string& text, double size = kTextPx);
/// The paragraphs in lines of at most that width, broken at spaces; a longer word has a line of its own.
std::vector<std::string> BrokenLines(const std::vector<std::string>& paragraphs, double width);
std::string DrawText(Pixel at, const std::string& text, const TextStyle& style = {});
std::string DrawLine(Pixel a, Pixel b, const std::string& colour, double width, bool dashed = false);
std::string DrawMarker(Pixel at, Marker marker, double size, const std::string& colour);
/// `corners` as "x,y x,y".
std::string PointList(const std::vector<Pixel>& corners);

/// A label and the places it may take: anchors of its text, best first.
struct Label {
  std::string text;
  std::string colour;
  struct Place {
    Pixel at;
    const char* anchor;
  };
  std::vector<Place> places;
  std::optional<Pixel> leader = {};  // a thin line from the text to here
  bool bold = false;
};

/// Places labels one after another where they cover least of each other and of what was blocked before.
class LabelPlacer {
 public:
  explicit LabelPlacer(Box frame) : frame_(frame) {}
  void Block(const Box& box) { taken_.push_back(box); }
  std::string Place(const Label& label);

 private:
  double Cost(const Box& box) const;

  Box frame_;
  std::vector<Box> taken_;
};

}  // namespace lensd::io
