// Places in a plane: marks with intervals, lines, floors and fronts, each labelled beside itself.
#include <algorithm>
#include <cmath>

#include "bench/report/axis.h"
#include "bench/report/chart.h"
#include "bench/report/labels.h"

namespace lensd::bench {
namespace {

constexpr double kEdge = 6.0;  // px kept free at the right

std::string PathOf(const std::vector<std::pair<double, double>>& points) {
  std::string d;
  char text[64];
  for (const auto& [x, y] : points) {
    std::snprintf(text, sizeof text, "%s%.1f %.1f", d.empty() ? "M" : "L", x, y);
    d += text;
  }
  return d;
}

/// A scatter chart laid out for one width and height.
class Scatter {
 public:
  Scatter(const ScatterChart& chart, double width, double height)
      : chart_(chart),
        drawing_(width),
        x_(chart.x, Values(&ChartMark::x, &ChartMark::x_range, &ChartRule::x)),
        y_(chart.y, Values(&ChartMark::y, &ChartMark::y_range, &ChartRule::y)) {
    const double above = kLineHeight * static_cast<double>(WrappedText(chart.y.label, width - 2 * kEdge).size()) + 8;
    y_.Lay(above + height, above);
    y_ticks_ = y_.Ticks(38.0);
    double widest = 0.0;
    for (const auto& [value, text] : y_ticks_) widest = std::max(widest, TextWidth(text, kTextSize));
    ground_ = {widest + 14.0, above, width - widest - 14.0 - kEdge, height};
    frame_ = ground_;
    // Lines are named where they end: there is room for that to their right.
    double names = 0.0;
    for (const ChartLine& line : chart.lines) names = std::max(names, TextWidth(line.label, kTextSize));
    frame_.width -= std::min(names, 0.3 * width);
    x_.Lay(frame_.x, frame_.right());
  }

  /// False: there is no room for every label.
  bool Try(bool clear_of_intervals) {
    Axes();
    Floors();
    Diagonal();
    for (const ChartLine& line : chart_.lines) Join(line);
    for (const ChartMark& mark : AllMarks()) Interval(mark);
    for (const ChartMark& mark : AllMarks()) {
      drawing_.Mark(x_.Px(mark.x), y_.Px(mark.y), mark.series, mark.tip);
    }
    return Labels(clear_of_intervals);
  }

  Drawing Take() { return std::move(drawing_); }

 private:
  template <class Value, class Range, class Rule>
  std::vector<double> Values(Value value, Range range, Rule rule) const {
    std::vector<double> values;
    const auto add = [&](const ChartMark& mark) {
      values.push_back(mark.*value);
      if (mark.*range) values.insert(values.end(), {(mark.*range)->low, (mark.*range)->high});
    };
    for (const ChartMark& mark : chart_.marks) add(mark);
    for (const ChartLine& line : chart_.lines) std::ranges::for_each(line.marks, add);
    for (const ChartRule& at : chart_.rules) {
      if (at.*rule) values.push_back(*(at.*rule));
    }
    return values;
  }

  std::vector<ChartMark> AllMarks() const {
    std::vector<ChartMark> all = chart_.marks;
    for (const ChartLine& line : chart_.lines) {
      if (!line.steps) all.insert(all.end(), line.marks.begin(), line.marks.end());
    }
    return all;
  }

  void Axes() {
    double line = 0.5 * kLineHeight + 1;
    for (const std::string& text : WrappedText(chart_.y.label, drawing_.width() - 2 * kEdge)) {
      drawing_.Text(2.0, line, text, Align::Start, "t a");
      line += kLineHeight;
    }
    for (const auto& [value, text] : y_ticks_) {
      const double y = y_.Px(value);
      drawing_.Line(frame_.x, y, frame_.right(), y, "grid");
      drawing_.Text(frame_.x - 6, y, text, Align::End);
    }
    double free_from = 0.0;
    for (const auto& [value, text] : x_.Ticks(64.0)) {
      const double x = x_.Px(value), half = 0.5 * TextWidth(text, kTextSize);
      drawing_.Line(x, frame_.y, x, frame_.bottom(), "grid");
      const double middle = std::clamp(x, half + 1, drawing_.width() - half - 1);
      if (middle - half < free_from) continue;
      drawing_.Text(middle, frame_.bottom() + 16, text, Align::Middle);
      free_from = middle + half + 4;
    }
    drawing_.Line(frame_.x, frame_.bottom(), frame_.right(), frame_.bottom(), "axis");
    drawing_.Line(frame_.x, frame_.y, frame_.x, frame_.bottom(), "axis");
    line = frame_.bottom() + 16 + kLineHeight + 2;
    for (const std::string& text : WrappedText(chart_.x.label, drawing_.width() - 2 * kEdge)) {
      drawing_.Text(0.5 * drawing_.width(), line, text, Align::Middle, "t a");
      line += kLineHeight;
    }
    drawing_.SetHeight(line - 0.5 * kLineHeight + 4);
  }

  void Floors() {
    for (const ChartRule& rule : chart_.rules) {
      if (rule.x) {
        drawing_.Line(x_.Px(*rule.x), frame_.y, x_.Px(*rule.x), frame_.bottom(), "floor");
      } else {
        drawing_.Line(frame_.x, y_.Px(*rule.y), frame_.right(), y_.Px(*rule.y), "floor");
      }
    }
  }

  void Diagonal() {
    if (!chart_.diagonal) return;
    const double low = std::max(x_.low(), y_.low()), high = std::min(x_.high(), y_.high());
    if (low < high) drawing_.Line(x_.Px(low), y_.Px(low), x_.Px(high), y_.Px(high), "floor");
  }

  void Join(const ChartLine& line) {
    std::vector<std::pair<double, double>> points;
    for (const ChartMark& mark : line.marks) {
      if (line.steps && !points.empty()) points.emplace_back(x_.Px(mark.x), points.back().second);
      points.emplace_back(x_.Px(mark.x), y_.Px(mark.y));
    }
    const std::string style = line.steps ? "front" : "l l" + std::to_string(line.series % kSeries);
    if (points.size() > 1) drawing_.Path(PathOf(points), style + (line.dashed ? " dashed" : ""));
  }

  void Interval(const ChartMark& mark) {
    const std::string style = "i l" + std::to_string(mark.series % kSeries);
    const double x = x_.Px(mark.x), y = y_.Px(mark.y);
    if (mark.x_range) drawing_.Line(x_.Px(mark.x_range->low), y, x_.Px(mark.x_range->high), y, style);
    if (mark.y_range) drawing_.Line(x, y_.Px(mark.y_range->low), x, y_.Px(mark.y_range->high), style);
  }

  /// What lines cover, as small boxes along them.
  void TakeLines(std::vector<Box>& taken) const {
    const auto take = [&](double x, double y, double to_x, double to_y) {
      const double dx = to_x - x, dy = to_y - y;
      const int parts = 1 + static_cast<int>(std::hypot(dx, dy) / 6.0);
      for (int k = 0; k <= parts; ++k) taken.push_back({x + dx * k / parts - 1, y + dy * k / parts - 1, 2, 2});
    };
    for (const ChartLine& line : chart_.lines) {
      for (std::size_t i = 1; i < line.marks.size(); ++i) {
        const double x = x_.Px(line.marks[i - 1].x), y = y_.Px(line.marks[i - 1].y);
        const double to_x = x_.Px(line.marks[i].x), to_y = y_.Px(line.marks[i].y);
        if (line.steps) {
          take(x, y, to_x, y);
          take(to_x, y, to_x, to_y);
        } else {
          take(x, y, to_x, to_y);
        }
      }
    }
  }

  bool Labels(bool clear_of_intervals) {
    std::vector<Labelled> wanted;
    std::vector<std::string> texts;
    std::vector<Box> taken;
    const auto add = [&](double x, double y, const std::string& text) {
      const Box box = Drawing::TextBox(0.0, 0.0, text, Align::Start);
      wanted.push_back({x, y, text.empty() ? 0.0 : box.width, text.empty() ? 0.0 : box.height});
      texts.push_back(text);
    };
    for (const ChartMark& mark : AllMarks()) {
      const double x = x_.Px(mark.x), y = y_.Px(mark.y);
      add(x, y, mark.label);
      if (!clear_of_intervals) continue;
      if (mark.x_range)
        taken.push_back({x_.Px(mark.x_range->low), y - 1, x_.Px(mark.x_range->high) - x_.Px(mark.x_range->low), 2});
      if (mark.y_range)
        taken.push_back({x - 1, y_.Px(mark.y_range->high), 2, y_.Px(mark.y_range->low) - y_.Px(mark.y_range->high)});
    }
    if (clear_of_intervals) TakeLines(taken);
    for (const ChartLine& line : chart_.lines) {
      if (line.marks.empty() || line.label.empty()) continue;
      add(x_.Px(line.marks.back().x), y_.Px(line.marks.back().y), line.label);
    }
    for (const ChartRule& rule : chart_.rules) {
      if (rule.label.empty()) continue;
      add(rule.x ? x_.Px(*rule.x) : frame_.right() - 8, rule.y ? y_.Px(*rule.y) : frame_.y + 10, rule.label);
    }
    const auto places = PlaceLabels(ground_, wanted, taken);
    if (!places) return false;
    for (std::size_t i = 0; i < texts.size(); ++i) {
      if (texts[i].empty()) continue;
      const Box& box = (*places)[i].box;
      if ((*places)[i].leader) {
        drawing_.Line(wanted[i].x, wanted[i].y, std::clamp(wanted[i].x, box.x, box.right()),
                      std::clamp(wanted[i].y, box.y, box.bottom()), "leader");
      }
      drawing_.Text(box.x, box.y + 0.5 * box.height, texts[i], Align::Start, "t d");
    }
    return true;
  }

  const ScatterChart& chart_;
  Drawing drawing_;
  Scale x_, y_;
  std::vector<std::pair<double, std::string>> y_ticks_;
  Box ground_{};  ///< where labels may stand
  Box frame_{};   ///< where marks do
};

}  // namespace

Drawing Draw(const ScatterChart& chart, double width) {
  double height = chart.height;
  for (int tries = 0; tries < 12; ++tries, height *= 1.15) {
    Scatter scatter(chart, width, height);
    if (scatter.Try(tries < 6)) return scatter.Take();
  }
  // So many labels that no height holds them; each is still told under the pointer.
  ScatterChart bare = chart;
  for (ChartMark& mark : bare.marks) mark.label.clear();
  Scatter scatter(bare, width, height);
  scatter.Try(false);
  return scatter.Take();
}

}  // namespace lensd::bench
