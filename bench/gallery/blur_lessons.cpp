// Lessons about blur: over depth, across a tilted plane, over the f-number, and what depth of field it leaves.
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/quantity_text.h"
#include "bench/gallery/curves.h"
#include "bench/gallery/lessons.h"
#include "optics/blur.h"
#include "optics/conjugates.h"
#include "optics/diffraction.h"
#include "optics/light.h"
#include "optics/thin_lens.h"

namespace lensd::bench {
namespace {

optics::ThinLens FocusedOn(Metres focal_length, double f_number, Dioptres focus) {
  return {focal_length, FNumber{f_number}, optics::Extension(focal_length, focus)};
}

double SignedBlurUm(const optics::ThinLens& lens, optics::ObjectDepth depth) {
  return optics::SignedBlur(lens, depth).value * 1e6;
}

std::string Named(const optics::ThinLens& lens) {
  return "f/" + Short(lens.f_number.value, 3);
}

/// The stops of a lens over an axis.
std::vector<std::pair<double, std::string>> Stops() {
  std::vector<std::pair<double, std::string>> ticks;
  for (const double stop : {1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 22.0, 32.0, 45.0, 64.0})
    ticks.emplace_back(stop, Short(stop));
  return ticks;
}

}  // namespace

Lesson SignedBlurLesson() {
  constexpr Dioptres kFocus{1.0}, kNearest{2.0};
  constexpr Metres kFarthest{6.0};
  io::Chart over_vergence, over_distance;
  over_vergence.title = "over vergence 1/Z";
  over_vergence.x = {.label = "vergence of the subject", .unit = "D", .low = 0.0, .high = kNearest.value};
  over_distance.title = "over distance Z";
  over_distance.x = {.label = "distance of the subject", .unit = "m", .low = 0.0, .high = kFarthest.value};
  for (const double f_number : {2.0, 4.0, 8.0}) {
    const auto lens = FocusedOn(kNormal, f_number, kFocus);
    auto line = CurveOf([&](double u) { return SignedBlurUm(lens, Dioptres{u}); }, 0.0, kNearest.value);
    auto curve =
        CurveOf([&](double z) { return SignedBlurUm(lens, Metres{z}); }, 1.0 / kNearest.value, kFarthest.value);
    line.points = {line.points.front(), line.points.back()};  // straight
    line.label = curve.label = Named(lens);
    over_vergence.lines.push_back(std::move(line));
    over_distance.lines.push_back(std::move(curve));
  }
  for (io::Chart* chart : {&over_vergence, &over_distance}) {
    chart->y = {.label = "signed blur", .unit = "um", .low = -1500.0, .high = 1500.0};
    chart->rules = {{.y = 0.0, .dashed = false},
                    {.x = chart == &over_vergence ? kFocus.value : 1.0 / kFocus.value, .label = "in focus"}};
    chart->width = kHalfWidth;
    chart->height = 400;
  }
  return {.name = "signed-blur",
          .topic = "circle of confusion",
          .charts = {over_vergence, over_distance},
          .columns = 2,
          .read =
              "How to read it: above zero are disks of points behind the plane in focus, below zero of points in front "
              "of it, for a " +
              LengthText(kNormal) + " lens focused at " + LengthText(Metres{1.0 / kFocus.value}) + ".",
          .means =
              "What it means: over vergence blur is a straight line whose slope is the opening, so two ends say "
              "everything about all depths between them."};
}

Lesson TiltedPlaneLesson() {
  constexpr TiltedPlane plane;
  io::Chart chart;
  chart.title = "blur across a tilted plane, " + Short(plane.u0.value - plane.ux.value) + " D at the left edge to " +
                Short(plane.u0.value + plane.ux.value) + " D at the right";
  chart.x = {.label = "place across the frame, -1 left edge, 1 right edge", .low = -1.0, .high = 1.0};
  chart.y = {.label = "blur diameter", .unit = "um", .low = 0.0};
  const double tip = (plane.focus.value - plane.u0.value) / plane.ux.value;
  for (const double f_number : {plane.f_number.value, 2.0 * plane.f_number.value, 4.0 * plane.f_number.value}) {
    const auto lens = FocusedOn(plane.focal_length, f_number, plane.focus);
    io::ChartLine line{.label = Named(lens)};
    for (const double x : {-1.0, tip, 1.0}) {
      const double blur = optics::Blur(lens, Dioptres{plane.u0.value + x * plane.ux.value}).value * 1e6;
      line.points.push_back({x, blur});
    }
    chart.lines.push_back(std::move(line));
  }
  chart.rules.push_back({.x = tip, .label = "in focus, " + Short(plane.focus.value) + " D"});
  chart.height = 360;
  return {.name = "tilted-plane",
          .topic = "thin lens: a plane in the scene",
          .charts = {chart},
          .read = "How to read it: each line is the blur that a " + LengthText(plane.focal_length) +
                  " lens makes along one row of the picture; the frame tilted-plane.png shows the widest opening.",
          .means =
              "What it means: on a plane vergence is straight in image coordinates, so blur is a V, and the largest "
              "blur of any region is at one of its corners."};
}

Lesson FNumberLesson() {
  constexpr Dioptres kFocus{0.5}, kSubject{0.48};
  constexpr double kWidest = 1.4, kNarrowest = 64.0;
  const auto at = [&](double n) { return FocusedOn(kNormal, n, kFocus); };
  const auto geometric = [&](double n) { return optics::Blur(at(n), kSubject).value * 1e6; };
  const auto diffraction = [&](double n) {
    const double m = optics::Magnification(kNormal, at(n).extension);
    return optics::DiffractionBlur(optics::DiffractionConvention::Airy, kGreen, optics::WorkingFNumber(FNumber{n}, m))
               .value *
           1e6;
  };
  const auto total = [&](double n) { return optics::TotalBlur(Metres{geometric(n)}, Metres{diffraction(n)}).value; };
  const double best = LeastOf(total, kWidest, kNarrowest);
  io::Chart chart;
  chart.title = LengthText(kNormal) + " lens focused at " + LengthText(Metres{1.0 / kFocus.value}) + ", subject at " +
                LengthText(Metres{1.0 / kSubject.value}, 4);
  chart.x = {.label = "f-number", .scale = io::Scale::Log, .low = kWidest, .high = kNarrowest, .ticks = Stops()};
  chart.y = {.label = "diameter of the disk", .unit = "um", .scale = io::Scale::Log};
  for (const auto& [formula, name] : {std::pair<Formula, const char*>{total, "both together"},
                                      {geometric, "out of focus: falls with N"},
                                      {diffraction, "diffraction: grows with N"}}) {
    auto line = CurveOf(formula, kWidest, kNarrowest, io::Scale::Log);
    line.label = name;
    line.dashed = !chart.lines.empty();
    line.width = chart.lines.empty() ? 2.6 : 1.8;
    chart.lines.push_back(std::move(line));
  }
  chart.points.push_back({.points = {{{best, total(best)}, ""}}, .colour = io::PaletteColour(0), .size = 5.0});
  chart.notes.push_back({.at = {best, total(best)},
                         .text = "least: " + Short(total(best), 3) + " um at f/" + Short(best, 3),
                         .dx = -20.0,
                         .dy = -60.0});
  chart.height = 400;
  return {.name = "total-blur",
          .topic = "diffraction",
          .charts = {chart},
          .read = "How to read it: both axes are logarithmic, so the disk of defocus falls and the Airy disk at " +
                  Nanometres(kGreen) + " rises along straight lines; the thick line is both together.",
          .means =
              "What it means: stopping down sharpens only up to the f-number where diffraction takes over, and "
              "farther out of focus that turn comes later."};
}

Lesson DepthOfFieldLesson() {
  constexpr FNumber kStop{8.0};
  constexpr Metres kLimit{30e-6};
  constexpr double kFirst = 0.04, kLast = 3.0, kTop = 30.0;
  const double hyperfocal = optics::thin_lens::Hyperfocal(kNormal.value, kStop.value, kLimit.value);
  const auto ends = [&](double ratio) {
    return optics::thin_lens::DepthOfField<double>(kNormal.value, kStop.value, kLimit.value, {ratio * hyperfocal, 1.0});
  };
  const auto near = [&](double ratio) { return 1.0 / ends(ratio).near / hyperfocal; };
  const auto far = [&](double ratio) {
    const double vergence = ends(ratio).far;
    return vergence > 1.0 / (2.0 * kTop * hyperfocal) ? 1.0 / vergence / hyperfocal : 2.0 * kTop;
  };
  io::Chart chart;
  chart.title = LengthText(kNormal) + " f/" + Short(kStop.value) + ", blur at most " + LengthText(kLimit) +
                ": hyperfocal distance H = " + LengthText(Metres{hyperfocal}, 4);
  chart.x = {.label = "focus distance over H", .scale = io::Scale::Log, .low = kFirst, .high = kLast};
  chart.y = {.label = "distance over H", .scale = io::Scale::Log, .low = kFirst / 2.0, .high = kTop};
  auto far_line = CurveOf(far, kFirst, kLast, io::Scale::Log), near_line = CurveOf(near, kFirst, kLast, io::Scale::Log);
  auto focus_line = CurveOf([](double ratio) { return ratio; }, kFirst, kLast, io::Scale::Log);
  focus_line.points = {focus_line.points.front(), focus_line.points.back()};
  io::ChartArea sharp{.corners = far_line.points, .colour = io::PaletteColour(0)};
  sharp.corners.insert(sharp.corners.end(), near_line.points.rbegin(), near_line.points.rend());
  chart.areas.push_back(std::move(sharp));
  far_line.label = "far end";
  near_line.label = "near end";
  focus_line.label = "in focus";
  focus_line.dashed = true;
  chart.lines = {std::move(far_line), std::move(near_line), std::move(focus_line)};
  chart.rules.push_back({.x = 1.0, .label = "from here on to infinity"});
  chart.points.push_back({.points = {{{1.0, near(1.0)}, ""}}, .colour = io::PaletteColour(1), .size = 5.0});
  chart.notes.push_back({.at = {1.0, near(1.0)},
                         .text = "focused at H: sharp from " + Short(near(1.0), 3) +
                                 " H = " + LengthText(Metres{near(1.0) * hyperfocal}, 4),
                         .dx = -30.0,
                         .dy = 70.0});
  chart.height = 420;
  return {
      .name = "depth-of-field",
      .topic = "depth of field, hyperfocal distance",
      .charts = {chart},
      .read =
          "How to read it: above each focus distance the shaded height is what is sharp, from its near end to its "
          "far end; both axes are in hyperfocal distances.",
      .means =
          "What it means: in these units the depth of field of every lens looks nearly alike: it is a thin slice near "
          "the camera, and from H on it has no far end."};
}

}  // namespace lensd::bench
