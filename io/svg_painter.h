// One chart on its way to text.
#pragma once

#include <algorithm>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "io/svg.h"
#include "svg_axis.h"
#include "svg_clip.h"
#include "svg_draw.h"

namespace lensd::io {

inline constexpr double kLineMarkerPx = 3.2;

struct LegendEntry {
  std::string name;
  std::function<std::string(Pixel)> swatch;  // kSwatchPx wide, from x on, centred on y
};

class Painter {
 public:
  Painter(const Chart& chart, std::size_t index);

  std::string Paint();
  /// After Paint(): some label had no room of its own.
  bool crowded() const { return placer_.crowded(); }
  /// px of the whole chart.
  double height() const { return height_; }

 private:
  std::string LineColour(std::size_t index) const {
    const std::string& own = chart_.lines[index].colour;
    return own.empty() ? PaletteColour(index) : own;
  }
  std::string PointsColour(std::size_t index) const {
    const std::string& own = chart_.points[index].colour;
    return own.empty() ? PaletteColour(chart_.lines.size() + index) : own;
  }
  static std::string FillColour(const std::string& own) { return own.empty() ? PaletteColour(0) : own; }

  Pixel At(const ChartPoint& point) const { return {x_.Pixel(point.x), y_.Pixel(point.y)}; }
  bool InPlot(const Pixel& at) const {
    return at.x >= plot_.left - 0.5 && at.x <= plot_.right + 0.5 && at.y >= plot_.top - 0.5 &&
           at.y <= plot_.bottom + 0.5;
  }

  void AddEntry(const std::string& name, std::function<std::string(Pixel)> swatch) {
    const bool known = std::ranges::find(legend_, name, &LegendEntry::name) != legend_.end();
    if (!name.empty() && !known) legend_.push_back({name, std::move(swatch)});
  }
  void CollectLegend();
  bool LegendAt(LegendPlace place) const { return chart_.legend == place && !legend_.empty(); }
  std::vector<Pixel> LegendPlaces() const;
  double LegendEntryWidth() const;
  void LayOut();
  void LayOutTitles();
  void Titles();
  void Grid();
  void Frame();
  void PaintArea(const ChartArea& area);
  void PaintBar(const ChartBar& bar);
  void PaintRule(const ChartRule& rule);
  void PaintLine(const ChartLine& line, const std::string& colour);
  void BlockAlong(const Pixel& from, const Pixel& to);
  void TickLabelsOfY(int wanted);
  void AddLineLabel(const ChartLine& line, const std::string& colour, const std::vector<Pixel>& visible);
  void PaintInterval(const ChartInterval& interval);
  void PaintPoints(const ChartPoints& points, const std::string& colour);
  void AddNote(const ChartNote& note);
  void PaintLegend();
  enum class Fill { Plain, Hatched, Outlined };
  static Fill FillOf(const ChartBar& bar) {
    return bar.hatched ? Fill::Hatched : bar.outlined ? Fill::Outlined : Fill::Plain;
  }
  std::string Filled(const Box& box, const std::string& colour, double opacity, Fill fill, const std::string& tip = {});

  const Chart& chart_;
  std::string id_;
  AxisMap x_, y_;
  Box plot_;
  std::vector<LegendEntry> legend_;
  std::vector<Label> labels_;
  LabelPlacer placer_{{}};
  struct {
    std::vector<std::string> title, subtitle, x;  // in lines
    double left = 0.0;                            // of the first two
  } titles_;
  double height_ = 0.0;
  std::string svg_;
  int patterns_ = 0;
};

}  // namespace lensd::io
