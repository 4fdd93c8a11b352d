// A camera at its own scale shows nothing: the subject is forty sensor distances away and the image a hair beside the
// sensor. What is drawn is another thin lens, on which both can be seen. Its vergences u are a straight line over the
// true ones, so that order is kept and each disk, being linear in vergence, is as many times too large as the others.
// Distances along the axis are in sensor distances, heights in half openings: a ray from (-1/u, y) through the lens at
// height h leaves it downward by (P - u) h + u y.
#include "cli/charts/ray_diagram.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/quantity_text.h"
#include "optics/conjugates.h"

namespace lensd::cli {
namespace {

constexpr double kReach = 2.1;       // of the drawing before and behind the lens
constexpr double kHeight = 2.1;      // above and below the axis
constexpr double kBlades = 1.35;     // how far up the stop and the sensor go
constexpr double kUnitPx = 84.0;     // of a height of 1, about: for labels
constexpr double kRowHeight = 0.24;  // from label to label
constexpr const char* kInk = "#444444";

/// The lens that is drawn.
struct Drawn {
  double power = 0.0;
  bool sensor = false;  ///< at 1
  double offset = 0.0, factor = 1.0;
  double half_gap = 0.0;  ///< of the principal planes
  std::string scale{};    ///< what is not to scale, for people

  double Vergence(Dioptres true_one) const { return offset + factor * true_one.value; }
};

double Power(const RaySystem& system) {
  return system.focal_length ? 1.0 / system.focal_length->value : 0.0;
}

/// Everything in one scale: `unit` metres are drawn as 1.
Drawn ToScale(const RaySystem& system, double unit) {
  return {.power = Power(system) * unit,
          .sensor = system.sensor_distance.has_value(),
          .factor = unit,
          .scale = "To scale along the axis; heights have a scale of their own."};
}

/// One point and its image. Where one of them is much farther than the other each side has its own scale.
Drawn Conjugates(const RaySystem& system) {
  constexpr double kFarther = 0.86 * kReach, kNearer = 0.9, kMostRatio = 2.5;
  const double f = system.focal_length->value, u = system.points.front().vergence.value, image = 1.0 / f - u;
  if (u == 0.0 || image == 0.0) return ToScale(system, f);
  const double object_m = 1.0 / std::abs(u), image_m = 1.0 / std::abs(image);
  const double most = std::max(object_m, image_m);
  if (most / std::min(object_m, image_m) <= kMostRatio) return ToScale(system, most / kFarther);
  if (u < 0.0 || image < 0.0) return ToScale(system, f);
  const double a = object_m > image_m ? kFarther : kNearer, b = object_m > image_m ? kNearer : kFarther;
  return {.power = 1.0 / a + 1.0 / b,
          .factor = object_m / a,
          .scale = "Not to scale: " + Short((object_m / a) / (image_m / b), 3) +
                   " mm before the lens are drawn as long as 1 mm behind it."};
}

Drawn ThroughHole(const RaySystem& system) {
  constexpr double kNearest = 1.6;
  double nearest = 0.0;
  for (const RayPoint& point : system.points) nearest = std::max(nearest, point.vergence.value);
  return {.sensor = true,
          .factor = nearest > 0.0 ? 1.0 / (kNearest * nearest) : 1.0,
          .scale = "Not to scale: subjects are drawn nearer than they are, and disks larger against the opening."};
}

/// A lens before its sensor. Disks are drawn kLargest openings wide at most; a point inside the focal length or at
/// infinity keeps the scale from being free.
Drawn ThroughLens(const RaySystem& system) {
  constexpr double kLargest = 0.45, kNearest = 0.9, kMostBehind = 0.5;
  const double sensor_m = system.sensor_distance->value, power = Power(system), focus = power - 1.0 / sensor_m;
  double nearest = focus, farthest = focus;
  for (const RayPoint& point : system.points) {
    nearest = std::max(nearest, point.vergence.value);
    farthest = std::min(farthest, point.vergence.value);
  }
  if (nearest > power) return ToScale(system, sensor_m);
  Drawn drawn{.sensor = true};
  const double spread = std::max(nearest - focus, focus - farthest);
  if (farthest <= 0.0 || spread <= 0.0) {
    drawn.factor = nearest > 0.0 ? 1.0 / (kNearest * nearest) : 1.0;
    if (nearest > focus) drawn.factor = std::min(drawn.factor, kMostBehind / (nearest - focus));  // images stay real
    if (focus < 0.0) drawn.factor = std::min(drawn.factor, -0.5 / focus);
  } else {
    drawn.factor = kLargest / spread;
    drawn.offset = 1.0 - drawn.factor * focus;
  }
  drawn.power = 1.0 + drawn.offset + drawn.factor * focus;
  drawn.scale = "Not to scale: disks are drawn " + Short(drawn.factor / sensor_m, 3) +
                " times as large against the opening; of distances only the order is kept.";
  return drawn;
}

Drawn DrawnOf(const RaySystem& system) {
  Drawn drawn = !system.sensor_distance ? Conjugates(system)
                : system.focal_length   ? ThroughLens(system)
                                        : ThroughHole(system);
  if (system.principal_gap.value > 0.0) drawn.half_gap = 0.09;
  return drawn;
}

/// One point on the drawn lens.
struct Path {
  const Drawn& drawn;
  double vergence, image, slope;  ///< vergences of point and image; downward slope of the ray through the centre

  Path(const Drawn& lens, const RayPoint& point)
      : drawn(lens), vergence(lens.Vergence(point.vergence)), image(lens.power - vergence), slope(0.0) {
    if (std::abs(image) < 1e-9) image = 0.0;
    if (!point.off_axis) return;
    // A point as high as the opening, so that one of its rays is parallel to the axis; lower where its image would be
    // too high to be seen.
    const double higher = image != 0.0 ? std::abs(vergence / image) : 0.0;
    slope = std::abs(vergence) > 1e-9 ? vergence * std::min(1.0, 0.8 * kHeight / higher) : 0.35;
  }
  /// On the ray through the lens at `height`, `along` before it or behind it.
  io::ChartPoint Before(double height, double along) const {
    return {-drawn.half_gap - along, height + (slope - height * vergence) * along};
  }
  io::ChartPoint Behind(double height, double along) const {
    return {drawn.half_gap + along, height - (slope + height * image) * along};
  }
  double Start() const { return vergence > 1.0 / kReach ? 1.0 / vergence : kReach; }
  double End() const { return drawn.sensor ? 1.0 : image > 1.25 / kReach ? 1.25 / image : kReach; }
};

bool InFrame(const io::ChartPoint& at) {
  return std::abs(at.x) < kReach && std::abs(at.y) < kHeight;
}

/// A label with a line to `at`, as high as the row says: from the top down, or with negative rows from the bottom up.
void AddLabel(io::Chart& chart, io::ChartPoint at, const std::string& text, double row, double dx,
              const std::string& colour) {
  at = {std::clamp(at.x, -0.98 * kReach, 0.98 * kReach), std::clamp(at.y, -0.9 * kHeight, 0.9 * kHeight)};
  const double wanted = row >= 0.0 ? 0.9 * kHeight - row * kRowHeight : -0.93 * kHeight - (row + 1.0) * kRowHeight;
  chart.notes.push_back({.at = at, .text = text, .dx = dx, .dy = (at.y - wanted) * kUnitPx, .colour = colour});
}

std::string ObjectWords(Dioptres vergence) {
  if (vergence.value == 0.0) return "infinitely far";
  if (vergence.value < 0.0) return LengthText(Metres{-1.0 / vergence.value}, 4) + " behind the lens";
  return "at " + LengthText(Metres{1.0 / vergence.value}, 4);
}

std::string ImageWords(const RaySystem& system, Dioptres vergence) {
  const Metres f = *system.focal_length;
  if (std::abs(vergence.value * f.value - 1.0) < 1e-12) return "image infinitely far";
  const Metres image = f + optics::Extension(f, vergence);
  if (image.value < 0.0) return "virtual image " + LengthText(-image, 4) + " before the lens";
  return "image at " + LengthText(image, 4);
}

void AddLight(io::Chart& chart, const RaySystem& system, const Path& path, const std::string& colour) {
  const bool pinhole = system.diameter && system.diameter->value == 0.0;
  const double start = path.Start(), end = path.End();
  if (!pinhole) {
    chart.areas.push_back(
        {.corners = {path.Before(1, start), path.Before(1, 0), path.Behind(1, 0), path.Behind(1, end),
                     path.Behind(-1, end), path.Behind(-1, 0), path.Before(-1, 0), path.Before(-1, start)},
         .colour = colour,
         .opacity = 0.07});
  }
  for (const double height : {1.0, 0.0, -1.0}) {
    if (pinhole && height != 0.0) continue;
    chart.lines.push_back({.points = {path.Before(height, start), path.Before(height, 0.0), path.Behind(height, 0.0),
                                      path.Behind(height, end)},
                           .colour = colour,
                           .width = height == 0.0 ? 1.3 : 1.8});
    const auto dash = [&](const io::ChartPoint& from, const io::ChartPoint& to) {
      chart.lines.push_back({.points = {from, to}, .colour = colour, .width = 1.2, .dashed = true});
    };
    if (path.vergence < 0.0) dash(path.Behind(height, 0.0), path.Before(height, 1.0 / path.vergence));
    if (!system.focal_length) continue;
    if (path.image < 0.0) dash(path.Before(height, 0.0), path.Behind(height, 1.0 / path.image));
    if (path.image > 0.0 && 1.0 / path.image > end)
      dash(path.Behind(height, end), path.Behind(height, 1.0 / path.image));
  }
}

void AddImage(io::Chart& chart, const RaySystem& system, const RayPoint& point, const Path& path, double row,
              const std::string& colour) {
  if (!system.focal_length) return;
  const std::string text = ImageWords(system, point.vergence);
  const bool somewhere = path.image != 0.0;
  const io::ChartPoint at = path.Behind(0.0, somewhere ? 1.0 / path.image : kReach);
  if (InFrame(at) && somewhere) {
    const bool formed = path.image > 0.0 && 1.0 / path.image <= path.End() + 1e-9;
    chart.points.push_back(
        {.points = {{at, ""}}, .colour = colour, .marker = formed ? io::Marker::Dot : io::Marker::Ring});
  }
  AddLabel(chart, at, text, row, at.x < 0.0 ? 10.0 : -10.0, colour);
}

void AddPoint(io::Chart& chart, const RaySystem& system, const Drawn& drawn, int index) {
  const RayPoint& point = system.points[static_cast<std::size_t>(index)];
  const std::string colour = io::PaletteColour(static_cast<std::size_t>(index));
  const Path path(drawn, point);
  AddLight(chart, system, path, colour);
  const io::ChartPoint object = path.Before(0.0, path.vergence == 0.0 ? kReach : 1.0 / path.vergence);
  if (path.vergence != 0.0 && InFrame(object)) chart.points.push_back({.points = {{object, ""}}, .colour = colour});
  // No line to a label crosses another label where texts before the lens go to the right and fall from the farthest
  // point to the nearest, and texts behind it go to the left and fall likewise.
  const auto farther = [&](const RayPoint& other) { return other.vergence < point.vergence; };
  const auto rank = static_cast<double>(std::ranges::count_if(system.points, farther));
  AddLabel(chart, object, point.name + " " + ObjectWords(point.vergence), rank, 8.0, colour);
  AddImage(chart, system, point, path, rank - static_cast<double>(system.points.size() + (drawn.sensor ? 1 : 0)),
           colour);
  constexpr double kNoDisk = 1e-12;
  if (!drawn.sensor || !point.blur || point.blur->value < kNoDisk) return;
  const double top = path.Behind(1.0, 1.0).y, bottom = path.Behind(-1.0, 1.0).y;
  const double x = 1.0 + drawn.half_gap + 0.025 * (index + 1);
  const double low = std::min(top, bottom), high = std::max(top, bottom);
  chart.lines.push_back({.points = {{x, low}, {x, high}}, .colour = colour, .width = 4.0});
  AddLabel(chart, {x, high}, "disk " + LengthText(*point.blur, 3), index, 30.0, colour);
}

void Upright(io::Chart& chart, double x, double low, double high, double width, const std::string& label = "") {
  chart.lines.push_back({.points = {{x, low}, {x, high}}, .colour = kInk, .width = width, .label = label});
}

/// The stop, and in it the thin lens as an arrow with two heads, or its two principal planes.
void AddOpening(io::Chart& chart, const RaySystem& system, const Drawn& drawn) {
  const bool pinhole = system.diameter && system.diameter->value == 0.0;
  const double edge = pinhole ? 0.03 : 1.0;
  for (const double side : {-1.0, 1.0}) {
    Upright(chart, -drawn.half_gap, side * edge, side * kBlades, 5.0);
    if (!system.focal_length || drawn.half_gap > 0.0) continue;
    chart.lines.push_back(
        {.points = {{-0.035, side * 0.93}, {0.0, side}, {0.035, side * 0.93}}, .colour = kInk, .width = 1.5});
  }
  if (drawn.half_gap > 0.0) {
    for (const double side : {-1.0, 1.0}) {
      chart.lines.push_back({.points = {{side * drawn.half_gap, -kBlades}, {side * drawn.half_gap, kBlades}},
                             .colour = kInk,
                             .dashed = true});
      chart.notes.push_back({.at = {side * drawn.half_gap, -kBlades},
                             .text = side < 0.0 ? "H" : "H′",
                             .dx = side * 6.0,
                             .dy = 14.0,
                             .colour = kInk});
    }
  } else if (system.focal_length) {
    Upright(chart, 0.0, -1.0, 1.0, 1.6);
  }
  std::string text = system.focal_length ? "lens, f = " + LengthText(*system.focal_length, 4)
                     : pinhole           ? "pinhole"
                                         : "hole";
  if (system.diameter && !pinhole) text += ", " + LengthText(*system.diameter, 4) + " wide";
  if (drawn.half_gap > 0.0) text += ", H to H′ " + LengthText(system.principal_gap, 3);
  AddLabel(chart, {-drawn.half_gap, kBlades}, text, 0.0, 6.0, kInk);
}

void AddSensor(io::Chart& chart, const RaySystem& system, const Drawn& drawn) {
  Upright(chart, 1.0 + drawn.half_gap, -kBlades, kBlades, 2.6);
  AddLabel(chart, {1.0 + drawn.half_gap, -kBlades}, "sensor at " + LengthText(*system.sensor_distance, 4), -1.0, 8.0,
           kInk);
  if (!system.focal_length) return;
  const Dioptres focus{Power(system) - 1.0 / system.sensor_distance->value};
  const double u = drawn.Vergence(focus);
  const bool drawn_already = std::ranges::any_of(
      system.points, [&](const RayPoint& point) { return std::abs(drawn.Vergence(point.vergence) - u) < 1e-6; });
  if (focus.value <= 0.0 || u <= 1.0 / kReach || drawn_already) return;
  const double x = -drawn.half_gap - 1.0 / u;
  chart.lines.push_back({.points = {{x, -1.0}, {x, 1.0}}, .colour = kInk, .width = 1.2, .dashed = true});
  AddLabel(chart, {x, -1.0}, "in focus " + ObjectWords(focus), -1.0, 8.0, kInk);
}

/// F and F' of the drawn lens.
void AddFocalPoints(io::Chart& chart, const Drawn& drawn) {
  for (const double side : {-1.0, 1.0}) {
    const io::ChartPoint at{side * (drawn.half_gap + 1.0 / drawn.power), 0.0};
    if (!InFrame(at)) continue;
    chart.points.push_back({.points = {{at, side < 0.0 ? "F" : "F′"}}, .colour = kInk, .marker = io::Marker::Cross});
  }
}

}  // namespace

io::Chart RayDiagram(const RaySystem& system) {
  const Drawn drawn = DrawnOf(system);
  io::Chart chart;
  chart.title = system.title;
  chart.x = {.low = -kReach, .high = kReach, .ticks = {{0.0, ""}}};
  chart.y = {.low = -kHeight, .high = kHeight, .ticks = {{0.0, ""}}};
  chart.legend = io::LegendPlace::None;
  chart.captions = {drawn.scale};
  chart.lines.push_back({.points = {{-kReach, 0.0}, {kReach, 0.0}}, .colour = "#888888", .width = 1.0});
  for (int i = 0; i < static_cast<int>(system.points.size()); ++i) AddPoint(chart, system, drawn, i);
  AddOpening(chart, system, drawn);
  if (drawn.sensor) AddSensor(chart, system, drawn);
  if (!drawn.sensor && drawn.power > 0.0) AddFocalPoints(chart, drawn);
  chart.height = 460;
  return chart;
}

}  // namespace lensd::cli
