#include "cli/plan/plot.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "cli/text.h"
#include "io/svg.h"
#include "optics/blur.h"
#include "optics/conjugates.h"
#include "optics/diffraction.h"

namespace lensd::cli {
namespace {

using optics::LimitKind;
using optics::PlanRequest;
using optics::Side;

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

struct FNumberRange {
  double low, high;
};
FNumberRange FNumbersOf(const PlanRequest& request) {
  double low = request.f_numbers.low.value, high = request.f_numbers.high.value;
  if (!request.apertures_are_diameters) return {low, high};
  return {request.focal_length.value / high, request.focal_length.value / low};
}

/// The extension at which a point of vergence `u` is blurred by exactly the limit, focused nearer than it (`sign` +1)
/// or farther (-1): e = (f² U + sign c N)/W. Diffraction leaves less of a sharp limit for geometry.
double Bound(const PlanRequest& request, const optics::BlurLimit& limit, double u, double n, double sign) {
  const double f = request.focal_length.value;
  const double tolerance = request.f_number_tolerance.value;
  double blur = limit.limit.value * optics::PupilDivisor(Metres{f}, Dioptres{u}, request.pupil_factor.value);
  blur *= limit.kind == LimitKind::Sharp ? 1.0 - tolerance : 1.0 + tolerance;
  const double gap = 1.0 - f * u;
  if (request.wavelength && limit.kind == LimitKind::Sharp) {
    const double working = n / gap;  // close enough to draw: Z_s/A for a subject in focus
    const double disk =
        optics::DiffractionBlur(request.diffraction, Metres{request.wavelength->value}, FNumber{working}).value;
    if (disk >= blur) return NAN;
    blur = std::sqrt(blur * blur - disk * disk);
  }
  return (f * f * u + sign * blur * n) / gap;
}

/// One edge of what a limit allows: extensions at least (or at most) this, at each f-number.
struct Edge {
  std::string label;
  std::size_t limit;  // its index
  bool at_least;
  double vergence;
  double sign;
};

std::string LimitText(const PlanRequest& request, const optics::BlurLimit& limit) {
  const bool sharp = limit.kind == LimitKind::Sharp;
  const double blur = limit.limit.value;
  const std::string size = request.pixel ? Short(blur / request.pixel->value, 3) + " px" : Short(blur * 1e6, 3) + " um";
  return limit.name + (sharp ? " ≤ " : " ≥ ") + size;
}

/// On which side of the plane in focus a blurred interval lies: as given, else as the plan (or the middle of what must
/// be sharp) has it.
bool IsBehind(const optics::BlurLimit& limit, const Vergences& ends, double focal_plane) {
  if (limit.side != Side::Either) return limit.side == Side::Behind;
  return 0.5 * (ends.near + ends.far) < focal_plane;
}

void AddEdges(const PlanRequest& request, std::size_t index, double focal_plane, std::vector<Edge>& edges) {
  const auto& limit = request.limits[index];
  const std::string label = LimitText(request, limit);
  std::optional<double> behind, front;  // the decisive ends of all its intervals
  std::optional<double> nearest, farthest;
  for (const auto& interval : limit.depths) {
    const Vergences ends = Ends(interval);
    nearest = std::max(nearest.value_or(ends.near), ends.near);
    farthest = std::min(farthest.value_or(ends.far), ends.far);
    if (limit.kind == LimitKind::Sharp) continue;
    if (IsBehind(limit, ends, focal_plane)) {
      behind = std::max(behind.value_or(ends.near), ends.near);
    } else {
      front = std::min(front.value_or(ends.far), ends.far);
    }
  }
  if (limit.kind == LimitKind::Sharp && nearest) {
    edges.push_back({label + " (near end)", index, true, *nearest, -1.0});
    edges.push_back({label + " (far end)", index, false, *farthest, 1.0});
  }
  if (behind) edges.push_back({label + " (behind)", index, true, *behind, 1.0});
  if (front) edges.push_back({label + " (in front)", index, false, *front, -1.0});
}

/// Where the plane in focus is, or would be best: for sides that are open.
double FocalPlaneOf(const PlanRequest& request, const optics::PlanAnswer& answer) {
  if (answer.feasible) return answer.focal_plane.value;
  if (request.focus) return request.focus->vergence().value;
  double sum = 0.0;
  int count = 0;
  for (const auto& limit : request.limits) {
    for (const auto& interval : limit.depths) {
      if (limit.kind != LimitKind::Sharp) continue;
      const Vergences ends = Ends(interval);
      sum += 0.5 * (ends.near + ends.far);
      ++count;
    }
  }
  return count > 0 ? sum / count : 0.0;
}

/// The extension of an edge at f-number n, the sensor's tolerance taken off.
double EdgeAt(const PlanRequest& request, const Edge& edge, double n) {
  const double slack = request.sensor_tolerance.value;
  return Bound(request, request.limits[edge.limit], edge.vergence, n, edge.sign) + (edge.at_least ? slack : -slack);
}

struct Strip {
  double low, high;
};
Strip StripAt(const PlanRequest& request, const std::vector<Edge>& edges, double n) {
  Strip strip{request.extensions.low.value, request.extensions.high.value};
  for (const Edge& edge : edges) {
    const double e = EdgeAt(request, edge, n);
    if (!std::isfinite(e)) return {1.0, 0.0};
    if (edge.at_least) {
      strip.low = std::max(strip.low, e);
    } else {
      strip.high = std::min(strip.high, e);
    }
  }
  return strip;
}

double SampleNumber(const FNumberRange& range, int index) {
  return range.low * std::pow(range.high / range.low, static_cast<double>(index) / kSamples);
}

double SensorMm(const PlanRequest& request, double extension) {
  return (request.focal_length.value + extension) * 1e3;
}

/// Corners of what all these edges and the extension range leave; empty where that is nothing.
std::vector<io::ChartPoint> Feasible(const PlanRequest& request, const std::vector<Edge>& edges,
                                     const FNumberRange& range) {
  std::vector<io::ChartPoint> corners, back;
  for (int i = 0; i <= kSamples; ++i) {
    const double n = SampleNumber(range, i);
    const Strip strip = StripAt(request, edges, n);
    if (strip.low > strip.high) continue;
    corners.push_back({n, SensorMm(request, strip.high)});
    back.push_back({n, SensorMm(request, strip.low)});
  }
  corners.insert(corners.end(), back.rbegin(), back.rend());
  return corners;
}

std::vector<std::pair<double, std::string>> StopTicks(const FNumberRange& range) {
  std::vector<std::pair<double, std::string>> ticks;
  for (const double stop : {0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 22.0, 32.0, 45.0, 64.0}) {
    if (stop >= range.low * 0.97 && stop <= range.high * 1.03) ticks.emplace_back(stop, Short(stop));
  }
  return ticks.size() >= 2 ? ticks : std::vector<std::pair<double, std::string>>();
}

/// The window of the sensor axis: what is feasible and the lines around it, not the whole travel of the lens.
void FrameSensorAxis(const PlanRequest& request, const optics::PlanAnswer& answer, const std::vector<Edge>& edges,
                     io::Chart& chart) {
  const FNumberRange range = FNumbersOf(request);
  std::vector<double> shown;
  for (const auto& area : chart.areas) {
    for (const auto& corner : area.corners) {
      if (answer.feasible) shown.push_back(corner.y);
    }
  }
  if (shown.empty()) {
    for (const Edge& edge : edges) {
      for (const double n : {range.low, std::sqrt(range.low * range.high)})
        shown.push_back(SensorMm(request, EdgeAt(request, edge, n)));
    }
  }
  if (request.focus) {
    const auto e = optics::FocusExtension(Metres{request.focal_length.value}, request.focus->vergence());
    if (e) shown.push_back(SensorMm(request, e->value));
  }
  if (answer.feasible) shown.push_back(answer.sensor_distance.value * 1e3);
  std::erase_if(shown, [](double value) { return !std::isfinite(value); });
  if (shown.empty())
    shown = {SensorMm(request, request.extensions.low.value), SensorMm(request, request.extensions.high.value)};
  const auto [least, most] = std::ranges::minmax_element(shown);
  const double room = std::max(0.25 * (*most - *least),
                               1e-3 * (request.extensions.high.value - request.extensions.low.value) * 1e3 + 1e-4);
  chart.y.low = *least - room;
  chart.y.high = *most + room;
}

void AddBox(const PlanRequest& request, io::Chart& chart) {
  const double low = SensorMm(request, request.extensions.low.value),
               high = SensorMm(request, request.extensions.high.value);
  chart.rules.push_back({.y = low, .label = "extension range, low end"});
  chart.rules.push_back({.y = high, .label = "extension range, high end"});
  for (const auto& stop : request.stops) {
    const double n = request.apertures_are_diameters ? request.focal_length.value / stop.value : stop.value;
    chart.rules.push_back({.x = n, .colour = "#bbbbbb"});
  }
  if (!request.focus) return;
  const auto e = optics::FocusExtension(Metres{request.focal_length.value}, request.focus->vergence());
  if (e)
    chart.rules.push_back({.y = SensorMm(request, e->value), .label = "focus", .colour = "#333333", .dashed = false});
}

std::string Colour(std::size_t limit) {
  return io::PaletteColour(limit + 1);
}

/// What each limit allows by itself, for a picture of why they do not meet.
void AddWedges(const PlanRequest& request, const std::vector<Edge>& edges, io::Chart& chart) {
  const FNumberRange range = FNumbersOf(request);
  for (std::size_t i = 0; i < request.limits.size(); ++i) {
    std::vector<Edge> own;
    std::ranges::copy_if(edges, std::back_inserter(own), [i](const Edge& edge) { return edge.limit == i; });
    io::ChartArea wedge{.corners = Feasible(request, own, range), .colour = Colour(i), .opacity = 0.12};
    if (!wedge.corners.empty()) chart.areas.push_back(std::move(wedge));
  }
}

io::Chart SettingsChart(const PlanRequest& request, const optics::PlanAnswer& answer) {
  const FNumberRange range = FNumbersOf(request);
  std::vector<Edge> edges;
  for (std::size_t i = 0; i < request.limits.size(); ++i) AddEdges(request, i, FocalPlaneOf(request, answer), edges);
  io::Chart chart;
  chart.title = "Settings that meet every limit";
  chart.x = {.label = "f-number",
             .scale = io::Scale::Log,
             .low = range.low / 1.03,
             .high = range.high * 1.03,
             .ticks = StopTicks(range)};
  chart.y = {.label = "sensor distance from the lens centre", .unit = "mm"};
  chart.legend = io::LegendPlace::Below;
  io::ChartArea feasible{.name = "feasible",
                         .corners = Feasible(request, edges, range),
                         .colour = io::PaletteColour(0),
                         .opacity = 0.28,
                         .outlined = true};
  if (!feasible.corners.empty()) chart.areas.push_back(feasible);
  if (!answer.feasible) AddWedges(request, edges, chart);
  for (const Edge& edge : edges) {
    io::ChartLine line{.colour = Colour(edge.limit), .width = kSharpWidth, .label = edge.label};
    line.dashed = request.limits[edge.limit].kind == LimitKind::Blurred;
    for (int i = 0; i <= kSamples; ++i) {
      const double n = SampleNumber(range, i);
      line.points.push_back({n, SensorMm(request, EdgeAt(request, edge, n))});
    }
    chart.lines.push_back(std::move(line));
  }
  FrameSensorAxis(request, answer, edges, chart);
  AddBox(request, chart);
  if (answer.feasible) {
    chart.subtitle = "each line bounds one limit, solid for sharp, dashed for blurred; shaded settings keep them all";
    const std::string label =
        "plan: f/" + Short(answer.f_number.value) + ", " + Short(answer.sensor_distance.value * 1e3, 6) + " mm";
    chart.points.push_back({.points = {{{answer.f_number.value, answer.sensor_distance.value * 1e3}, label}},
                            .colour = "#000000",
                            .marker = io::Marker::Diamond});
  } else {
    chart.title = "No setting meets every limit";
    for (const std::string& name : answer.conflict)
      chart.subtitle += (chart.subtitle.empty() ? "in conflict: " : ", ") + name;
  }
  return chart;
}

/// The vergences that the blur chart shows: all subjects and the focal plane, with some room.
Vergences Window(const PlanRequest& request, const optics::PlanAnswer& answer) {
  const double focal_plane = std::max(FocalPlaneOf(request, answer), 0.0);
  Vergences window{focal_plane, focal_plane};
  if (answer.depth_of_field) window = Ends(*answer.depth_of_field);
  for (const auto& limit : request.limits) {
    for (const auto& interval : limit.depths) {
      const Vergences ends = Ends(interval);
      window = {std::max(window.near, ends.near), std::min(window.far, ends.far)};
    }
  }
  const double room = std::max(0.15 * (window.near - window.far), 0.02 * window.near + 1e-6);
  return {window.near + room, std::max(0.0, window.far - room)};
}

/// Whole steps of vergence with their distances below, for readers who think in either.
std::vector<std::pair<double, std::string>> VergenceTicks(const Vergences& window) {
  constexpr double kMostTicks = 8.0;
  const double raw = (window.near - window.far) / kMostTicks;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  const double step = power * (raw <= 2.0 * power ? 2.0 : raw <= 5.0 * power ? 5.0 : 10.0);
  std::vector<std::pair<double, std::string>> ticks;
  for (double index = std::ceil(window.far / step); index * step <= window.near; ++index) {
    const double u = index * step;
    ticks.emplace_back(u, Short(u, 4) + "\n" + (u > 0.0 ? LengthText(Metres{1.0 / u}) : "infinity"));
  }
  return ticks;
}

double BlurAt(const PlanRequest& request, const optics::PlanAnswer& answer, double u) {
  const Metres f{request.focal_length.value};
  const double geometric = optics::Blur({f, answer.f_number, answer.extension}, Dioptres{u}).value /
                           optics::PupilDivisor(f, Dioptres{u}, request.pupil_factor.value);
  if (!request.wavelength) return geometric;
  const FNumber working = answer.f_number * (1.0 + answer.extension / f);
  const Metres disk = optics::DiffractionBlur(request.diffraction, Metres{request.wavelength->value}, working);
  return optics::TotalBlur(Metres{geometric}, disk).value;
}

io::Chart BlurChart(const PlanRequest& request, const optics::PlanAnswer& answer) {
  const Vergences window = Window(request, answer);
  const double unit = request.pixel ? request.pixel->value : 1e-6;
  io::Chart chart;
  chart.title = answer.feasible ? "Blur at the plan, against the limits" : "The limits";
  chart.subtitle =
      "hatched: what the blur must not enter; in vergence (1/distance) geometric blur is two straight lines";
  chart.x = {.label = "vergence of the subject [D], its distance below",
             .low = window.far,
             .high = window.near,
             .ticks = VergenceTicks(window)};
  chart.y = {.label = "blur diameter", .unit = request.pixel ? "px" : "um", .low = 0.0};
  chart.legend = io::LegendPlace::Below;
  double tallest = 0.0;
  for (std::size_t i = 0; i < request.limits.size(); ++i) {
    const auto& limit = request.limits[i];
    const bool sharp = limit.kind == LimitKind::Sharp;
    const double height = limit.limit.value / unit;
    tallest = std::max(tallest, height * 1.6);
    for (std::size_t k = 0; k < limit.depths.size(); ++k) {
      const Vergences ends = Ends(limit.depths[k]);
      io::ChartBar bar{.x_low = ends.far, .x_high = ends.near, .colour = Colour(i), .hatched = true};
      (sharp ? bar.y_low : bar.y_high) = height;
      if (k == 0) bar.label = LimitText(request, limit);
      chart.bars.push_back(std::move(bar));
    }
  }
  if (answer.depth_of_field && request.depth_limit) {
    const Vergences ends = Ends(*answer.depth_of_field);
    const double height = request.depth_limit->value / unit;
    chart.bars.push_back(
        {.x_low = ends.far, .x_high = ends.near, .y_low = height, .label = "depth of field", .hatched = true});
    tallest = std::max(tallest, 1.6 * height);
  }
  if (answer.feasible) {
    io::ChartLine line{
        .name = "blur at f/" + Short(answer.f_number.value) + ", focused at " + DepthText(answer.focal_plane),
        .colour = "#000000",
        .width = 2.0};
    const double middle = std::clamp(answer.focal_plane.value, window.far, window.near);
    for (int i = 0; i <= kSamples; ++i) {
      const double part = static_cast<double>(i) / kSamples;
      // Both arms meet at the focal plane exactly.
      const double u = part < 0.5 ? window.far + 2.0 * part * (middle - window.far)
                                  : middle + (2.0 * part - 1.0) * (window.near - middle);
      line.points.push_back({u, BlurAt(request, answer, u) / unit});
    }
    chart.lines.push_back(std::move(line));
    for (const auto& limit : answer.limits) {
      chart.points.push_back({.name = "worst point of a limit, tolerances included",
                              .points = {{{limit.at.value, limit.worst.value / unit}}},
                              .colour = "#000000",
                              .marker = io::Marker::Ring});
      tallest = std::max(tallest, 1.25 * limit.worst.value / unit);
    }
    chart.rules.push_back({.x = answer.focal_plane.value, .label = "in focus"});
  }
  if (tallest > 0.0) chart.y.high = tallest;
  return chart;
}

}  // namespace

std::string PlanPlot(const PlanRequest& request, const optics::PlanAnswer& answer) {
  io::Chart settings = SettingsChart(request, answer), blur = BlurChart(request, answer);
  for (io::Chart* chart : {&settings, &blur}) {
    chart->width = 780;
    chart->height = 560;
  }
  return io::ChartsSvg({settings, blur}, 2);
}

}  // namespace lensd::cli
