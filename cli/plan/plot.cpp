// Both charts ask the planner's own bounds and blur (optics/limit_bounds.h), so that nothing is shaded as possible that
// it calls impossible.
#include "cli/plan/plot.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "cli/text/text.h"
#include "cli/text/vergence_axis.h"
#include "io/svg.h"
#include "optics/conjugates.h"
#include "optics/limit_bounds.h"

namespace lensd::cli {
namespace {

using optics::BlurLimit;
using optics::LimitKind;
using optics::PlanRequest;

constexpr int kSamples = 240;
constexpr double kSharpWidth = 1.8;

/// The ends of an interval in dioptres.
struct Vergences {
  double near, far;
};
Vergences Ends(const optics::DepthInterval& interval) {
  const double a = interval.one_end.vergence().value, b = interval.other_end.vergence().value;
  return {std::max(a, b), std::min(a, b)};
}

/// The f-numbers that a chart shows: the stops, or samples of the range.
struct FNumbers {
  double low = 0.0, high = 0.0;
  std::vector<double> stops = {};

  double Sample(int index) const { return low * std::pow(high / low, static_cast<double>(index) / kSamples); }
};
FNumbers FNumbersOf(const PlanRequest& request) {
  const auto n = [&](const optics::Number& given) {
    return request.apertures_are_diameters ? request.focal_length.value / given.value : given.value;
  };
  FNumbers numbers;
  for (const auto& stop : request.stops) numbers.stops.push_back(n(stop));
  std::ranges::sort(numbers.stops);
  const double a = n(request.f_numbers.low), b = n(request.f_numbers.high);
  numbers.low = numbers.stops.empty() ? std::min(a, b) : numbers.stops.front();
  numbers.high = numbers.stops.empty() ? std::max(a, b) : numbers.stops.back();
  return numbers;
}

/// The plan, or, where there is none, the one that relaxed limits would allow.
struct Setting {
  FNumber f_number;
  Metres extension;  ///< as the planner counts it
  Dioptres focal_plane;
};
std::optional<Setting> SettingOf(const PlanRequest& request, const optics::PlanAnswer& answer) {
  if (!answer.feasible && !(answer.relax && answer.f_number.value > 0.0)) return std::nullopt;
  const Metres f{request.focal_length.value};
  return Setting{answer.f_number, request.liquid ? optics::LiquidExtension(f, answer.extension) : answer.extension,
                 answer.focal_plane};
}

std::string LimitText(const PlanRequest& request, const optics::BlurLimit& limit) {
  const bool sharp = limit.kind == LimitKind::Sharp;
  const double blur = limit.limit.value;
  const std::string size = request.pixel ? Short(blur / request.pixel->value, 3) + " px" : Short(blur * 1e6, 3) + " um";
  return limit.name + (sharp ? " ≤ " : " ≥ ") + size;
}

/// Where the plane in focus is, or would be best: for sides that are open.
Dioptres FocalPlaneOf(const PlanRequest& request, const optics::PlanAnswer& answer) {
  if (const auto setting = SettingOf(request, answer)) return setting->focal_plane;
  return request.focus ? request.focus->vergence() : Dioptres{};
}

double SensorMm(const PlanRequest& request, Metres extension) {
  return (request.focal_length.value + extension.value) * 1e3;
}

std::optional<Metres> FixedExtension(const PlanRequest& request) {
  if (!request.focus) return std::nullopt;
  const auto e = optics::FocusExtension(Metres{request.focal_length.value}, request.focus->vergence());
  return e ? std::optional(*e) : std::nullopt;
}

/// What all these limits and the ranges leave at one f-number.
optics::HoldingExtensions LeftAt(const PlanRequest& request, const std::vector<const BlurLimit*>& limits, double n,
                                 Dioptres focal_plane) {
  optics::HoldingExtensions left{{request.extensions.low.value}, {request.extensions.high.value}};
  const auto keep = [&](const optics::HoldingExtensions& holding) {
    left = {std::max(left.low, holding.low), std::min(left.high, holding.high)};
  };
  if (const auto e = FixedExtension(request)) keep({*e, *e});
  for (const BlurLimit* limit : limits) keep(optics::WhereHolds(request, *limit, {n}, focal_plane));
  return left;
}

/// All of it as areas: one for each stretch of f-numbers that leaves something, a line for each stop.
std::vector<io::ChartArea> Areas(const PlanRequest& request, const std::vector<const BlurLimit*>& limits,
                                 Dioptres focal_plane, const io::ChartArea& style) {
  const FNumbers numbers = FNumbersOf(request);
  std::vector<io::ChartArea> areas;
  std::vector<io::ChartPoint> upper, lower;
  const auto close = [&] {
    if (upper.empty()) return;
    areas.push_back(style);
    if (areas.size() > 1) areas.back().name.clear();
    areas.back().corners = std::exchange(upper, {});
    areas.back().corners.insert(areas.back().corners.end(), lower.rbegin(), lower.rend());
    lower.clear();
  };
  const auto sample = [&](double n) {
    const auto left = LeftAt(request, limits, n, focal_plane);
    if (left.low > left.high) return close();
    upper.push_back({n, SensorMm(request, left.high)});
    lower.push_back({n, SensorMm(request, left.low)});
  };
  if (numbers.stops.empty()) {
    for (int i = 0; i <= kSamples; ++i) sample(numbers.Sample(i));
  }
  for (const double stop : numbers.stops) sample(stop), close();
  close();
  return areas;
}

std::vector<std::pair<double, std::string>> StopTicks(const FNumbers& range) {
  std::vector<std::pair<double, std::string>> ticks;
  for (const double stop : {0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 22.0, 32.0, 45.0, 64.0}) {
    if (stop >= range.low * 0.97 && stop <= range.high * 1.03) ticks.emplace_back(stop, Short(stop));
  }
  return ticks.size() >= 2 ? ticks : std::vector<std::pair<double, std::string>>();
}

/// The window of the sensor axis: what is possible and the lines around it, not the whole travel of the lens.
void FrameSensorAxis(const PlanRequest& request, const optics::PlanAnswer& answer, io::Chart& chart) {
  std::vector<double> shown;
  for (const auto& area : chart.areas) {
    for (const auto& corner : area.corners) {
      if (answer.feasible) shown.push_back(corner.y);
    }
  }
  if (shown.empty()) {
    for (const auto& line : chart.lines) {
      if (line.points.empty()) continue;
      shown.push_back(line.points.front().y);
      shown.push_back(line.points[line.points.size() / 2].y);
    }
  }
  if (const auto e = FixedExtension(request)) shown.push_back(SensorMm(request, *e));
  if (const auto setting = SettingOf(request, answer)) shown.push_back(SensorMm(request, setting->extension));
  const Metres low{request.extensions.low.value}, high{request.extensions.high.value};
  if (shown.empty()) shown = {SensorMm(request, low), SensorMm(request, high)};
  const auto [least, most] = std::ranges::minmax_element(shown);
  const double room = std::max(0.25 * (*most - *least), (high - low).value + 1e-4);
  chart.y.low = *least - room;
  chart.y.high = *most + room;
}

void AddBox(const PlanRequest& request, io::Chart& chart) {
  chart.rules.push_back({.y = SensorMm(request, {request.extensions.low.value}), .label = "extension range, low end"});
  chart.rules.push_back(
      {.y = SensorMm(request, {request.extensions.high.value}), .label = "extension range, high end"});
  for (const double stop : FNumbersOf(request).stops) chart.rules.push_back({.x = stop, .colour = "#bbbbbb"});
  if (const auto e = FixedExtension(request)) {
    chart.rules.push_back({.y = SensorMm(request, *e), .label = "focus", .colour = "#333333", .dashed = false});
  }
}

std::string Colour(std::size_t limit) {
  return io::PaletteColour(limit + 1);
}

/// The least and the greatest extension that each limit leaves, as lines over the f-number.
void AddEdges(const PlanRequest& request, Dioptres focal_plane, io::Chart& chart) {
  const FNumbers numbers = FNumbersOf(request);
  for (std::size_t i = 0; i < request.limits.size(); ++i) {
    const BlurLimit& limit = request.limits[i];
    const bool sharp = limit.kind == LimitKind::Sharp;
    const io::ChartLine style{.colour = Colour(i), .width = kSharpWidth, .dashed = !sharp};
    io::ChartLine low = style, high = style;
    low.label = LimitText(request, limit) + (sharp ? " (near end)" : " (behind)");
    high.label = LimitText(request, limit) + (sharp ? " (far end)" : " (in front)");
    for (int k = 0; k <= kSamples; ++k) {
      const double n = numbers.Sample(k);
      const auto holds = optics::WhereHolds(request, limit, {n}, focal_plane);
      if (std::isfinite(holds.low.value)) low.points.push_back({n, SensorMm(request, holds.low)});
      if (std::isfinite(holds.high.value)) high.points.push_back({n, SensorMm(request, holds.high)});
    }
    for (io::ChartLine* line : {&low, &high}) {
      if (!line->points.empty()) chart.lines.push_back(std::move(*line));
    }
  }
}

/// What can be set: all that meets every limit, or what each limit allows by itself, to show why they do not meet.
void AddAreas(const PlanRequest& request, const optics::PlanAnswer& answer, io::Chart& chart) {
  const Dioptres focal_plane = FocalPlaneOf(request, answer);
  std::vector<const BlurLimit*> all;
  for (const BlurLimit& limit : request.limits) all.push_back(&limit);
  if (answer.feasible) {
    chart.areas = Areas(request, all, focal_plane,
                        {.name = "feasible", .colour = io::PaletteColour(0), .opacity = 0.28, .outlined = true});
    return;
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (auto& area : Areas(request, {all[i]}, focal_plane, {.colour = Colour(i), .opacity = 0.12})) {
      chart.areas.push_back(std::move(area));
    }
  }
}

/// Everything that the plan may be by its tolerances: all of it keeps every limit.
void AddTolerance(const PlanRequest& request, const Setting& setting, io::Chart& chart) {
  const double n = setting.f_number.value, off = request.f_number_tolerance.value;
  const Metres delta{request.sensor_tolerance.value};
  if (off <= 0.0 && delta.value <= 0.0) return;
  const double low = SensorMm(request, setting.extension - delta), high = SensorMm(request, setting.extension + delta);
  const double least = n * (1.0 - off), most = n * (1.0 + off);
  chart.areas.push_back(
      {.name = "tolerance: ± " + LengthText(delta, 3) + ", ± " + Short(100.0 * off, 3) + " % of f-number",
       .corners = {{least, low}, {most, low}, {most, high}, {least, high}},
       .colour = "#000000",
       .opacity = 0.2,
       .outlined = true});
}

io::Chart SettingsChart(const PlanRequest& request, const optics::PlanAnswer& answer) {
  const FNumbers numbers = FNumbersOf(request);
  io::Chart chart;
  chart.title = "settings that meet every limit";
  chart.x = {.label = "f-number",
             .scale = io::Scale::Log,
             .low = numbers.low / 1.03,
             .high = numbers.high * 1.03,
             .ticks = StopTicks(numbers)};
  chart.y = {.label = "sensor distance from the lens centre", .unit = "mm"};
  chart.legend = io::LegendPlace::Below;
  AddAreas(request, answer, chart);
  AddEdges(request, FocalPlaneOf(request, answer), chart);
  FrameSensorAxis(request, answer, chart);
  AddBox(request, chart);
  std::string label = "plan";
  if (answer.feasible) {
    chart.subtitle = "each line bounds one limit, solid for sharp, dashed for blurred; shaded settings keep them all";
  } else {
    chart.title = "no setting meets every limit";
    for (const std::string& name : answer.conflict)
      chart.subtitle += (chart.subtitle.empty() ? "in conflict: " : ", ") + name;
    if (answer.relax) label = "with limits relaxed " + Short(*answer.relax, 4) + " times";
  }
  if (const auto setting = SettingOf(request, answer)) {
    const double mm = SensorMm(request, setting->extension);
    AddTolerance(request, *setting, chart);
    label += ": f/" + Short(setting->f_number.value) + ", " + Short(mm, 6) + " mm";
    chart.points.push_back({.points = {{{setting->f_number.value, mm}, label}},
                            .colour = "#000000",
                            .marker = answer.feasible ? io::Marker::Diamond : io::Marker::Cross});
  }
  return chart;
}

/// The vergences that the blur chart shows: all subjects and the focal plane, with some room.
Vergences Window(const PlanRequest& request, const optics::PlanAnswer& answer) {
  std::optional<Vergences> window;
  const auto show = [&](const Vergences& ends) {
    window = {std::max(window.value_or(ends).near, ends.near), std::min(window.value_or(ends).far, ends.far)};
  };
  if (const auto setting = SettingOf(request, answer)) {
    const double plane = std::max(setting->focal_plane.value, 0.0);
    show({plane, plane});
  }
  if (answer.depth_of_field) show(Ends(*answer.depth_of_field));
  for (const auto& limit : request.limits) {
    for (const auto& interval : limit.depths) show(Ends(interval));
  }
  const auto [near, far] = window.value_or(Vergences{0.0, 0.0});
  const double room = std::max(0.15 * (near - far), 0.02 * near + 1e-6);
  return {near + room, std::max(0.0, far - room)};
}

/// What must not be entered: each limit over its depths, and the depth of field.
void AddLimits(const PlanRequest& request, const optics::PlanAnswer& answer, double unit, io::Chart& chart) {
  for (std::size_t i = 0; i < request.limits.size(); ++i) {
    const auto& limit = request.limits[i];
    const bool sharp = limit.kind == LimitKind::Sharp;
    const double height = limit.limit.value / unit;
    chart.y.high = std::max(chart.y.high.value_or(0.0), height * 1.6);
    for (std::size_t k = 0; k < limit.depths.size(); ++k) {
      const Vergences ends = Ends(limit.depths[k]);
      io::ChartBar bar{.x_low = ends.far, .x_high = ends.near, .colour = Colour(i), .hatched = true};
      (sharp ? bar.y_low : bar.y_high) = height;
      if (k == 0) bar.label = LimitText(request, limit);
      chart.bars.push_back(std::move(bar));
    }
  }
  if (!answer.depth_of_field || !request.depth_limit) return;
  const Vergences ends = Ends(*answer.depth_of_field);
  const double height = request.depth_limit->value / unit;
  chart.bars.push_back(
      {.x_low = ends.far, .x_high = ends.near, .y_low = height, .label = "depth of field", .hatched = true});
  chart.y.high = std::max(chart.y.high.value_or(0.0), 1.6 * height);
}

/// Between the least and the greatest blur within the tolerances.
void AddToleranceBand(const PlanRequest& request, const Setting& setting, const io::ChartLine& line, double unit,
                      io::Chart& chart) {
  const double off = request.f_number_tolerance.value;
  const Metres delta{request.sensor_tolerance.value};
  if (off <= 0.0 && delta.value <= 0.0) return;
  std::vector<io::ChartPoint> lower;
  io::ChartArea band{.name = "its tolerance", .colour = "#000000", .opacity = 0.15};
  for (const io::ChartPoint& point : line.points) {
    const auto depth = optics::PlanDepth::Vergence(point.x);
    double least = point.y, most = point.y;
    const auto in_focus = optics::FocusExtension(Metres{request.focal_length.value}, Dioptres{point.x});
    const Metres sharpest =
        std::clamp(in_focus.value_or(setting.extension), setting.extension - delta, setting.extension + delta);
    for (const double n : {1.0 - off, 1.0 + off}) {
      for (const Metres e : {setting.extension - delta, setting.extension + delta, sharpest}) {
        const double blur = optics::TotalBlurAt(request, depth, {setting.f_number.value * n}, e).value / unit;
        least = std::min(least, blur);
        most = std::max(most, blur);
      }
    }
    band.corners.push_back({point.x, most});
    lower.push_back({point.x, least});
  }
  band.corners.insert(band.corners.end(), lower.rbegin(), lower.rend());
  chart.areas.push_back(std::move(band));
}

/// Blur over vergence at the plan, and the worst point of each limit.
void AddBlur(const PlanRequest& request, const Setting& setting, const Vergences& window, double unit,
             io::Chart& chart) {
  io::ChartLine line{
      .name = "blur at f/" + Short(setting.f_number.value) + ", focused at " + DepthText(setting.focal_plane),
      .colour = "#000000",
      .width = 2.0};
  const double middle = std::clamp(setting.focal_plane.value, window.far, window.near);
  for (int i = 0; i <= kSamples; ++i) {
    const double part = static_cast<double>(i) / kSamples;
    // Both arms meet at the focal plane exactly.
    const double u = part < 0.5 ? window.far + 2.0 * part * (middle - window.far)
                                : middle + (2.0 * part - 1.0) * (window.near - middle);
    const auto depth = optics::PlanDepth::Vergence(u);
    line.points.push_back({u, optics::TotalBlurAt(request, depth, setting.f_number, setting.extension).value / unit});
  }
  AddToleranceBand(request, setting, line, unit, chart);
  chart.lines.push_back(std::move(line));
  const optics::WorstBlurs blurs(request, setting.f_number, setting.extension);
  for (const auto& limit : request.limits) {
    const auto worst = blurs.Of(limit);
    const double blur = worst.blur.value / unit;
    const bool holds = limit.kind == LimitKind::Sharp ? worst.blur.value <= limit.limit.value * (1.0 + 1e-9)
                                                      : worst.blur.value >= limit.limit.value * (1.0 - 1e-9);
    chart.points.push_back({.name = holds ? "worst point of a limit, tolerances included" : "a limit that it breaks",
                            .points = {{{worst.at->vergence().value, blur}}},
                            .colour = "#000000",
                            .marker = holds ? io::Marker::Ring : io::Marker::Cross});
    chart.y.high = std::max(chart.y.high.value_or(0.0), 1.25 * blur);
  }
  chart.rules.push_back({.x = setting.focal_plane.value, .label = "in focus"});
}

io::Chart BlurChart(const PlanRequest& request, const optics::PlanAnswer& answer) {
  const Vergences window = Window(request, answer);
  const double unit = request.pixel ? request.pixel->value : 1e-6;
  const auto setting = SettingOf(request, answer);
  io::Chart chart;
  chart.title = answer.feasible ? "blur at the plan, against the limits"
                : setting       ? "blur at the nearest plan, against the limits it breaks"
                                : "the limits";
  chart.subtitle =
      "hatched: what the blur must not enter; in vergence (1/distance) geometric blur is two straight lines";
  chart.x = VergenceAxis(Dioptres{window.far}, Dioptres{window.near});
  chart.y = {.label = "blur diameter", .unit = request.pixel ? "px" : "um", .low = 0.0};
  chart.legend = io::LegendPlace::Below;
  AddLimits(request, answer, unit, chart);
  if (setting) AddBlur(request, *setting, window, unit, chart);
  return chart;
}

}  // namespace

std::string PlanPlot(const PlanRequest& request, const optics::PlanAnswer& answer, const std::string& lens) {
  io::Chart settings = SettingsChart(request, answer), blur = BlurChart(request, answer);
  for (io::Chart* chart : {&settings, &blur}) {
    chart->title = lens + ": " + chart->title;
    chart->height = 540;
  }
  return io::ChartsSvg({settings, blur}, 1);
}

}  // namespace lensd::cli
