// Lessons about where light goes: conjugates, pinhole, a hole beside a lens, and the rays themselves.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/quantity_text.h"
#include "bench/gallery/curves.h"
#include "bench/gallery/lessons.h"
#include "cli/charts/ray_diagram.h"
#include "optics/blur.h"
#include "optics/conjugates.h"
#include "optics/diffraction.h"
#include "optics/thin_lens.h"

namespace lensd::bench {
namespace {

namespace thin_lens = optics::thin_lens;

constexpr double kUm = 1e6, kMm = 1e3;

double BlurOfHole(Metres diameter, Metres sensor_distance, const thin_lens::AxialPlace<double>& at) {
  return thin_lens::SignedBlurOfHole(diameter.value, sensor_distance.value, at);
}

}  // namespace

std::string Nanometres(Metres wavelength) {
  return Short(wavelength.value * 1e9) + " nm";
}

HoleDisks DisksOfHole(Metres diameter, Metres sensor_distance, Dioptres subject) {
  const Metres geometric{std::abs(BlurOfHole(diameter, sensor_distance, {1.0, subject.value}))};
  const Metres diffraction =
      optics::DiffractionBlur(optics::DiffractionConvention::Airy, kGreen, FNumber{sensor_distance / diameter});
  return {geometric, diffraction, optics::TotalBlur(geometric, diffraction)};
}

SharpestHole Sharpest(Metres sensor_distance, Dioptres subject) {
  const auto disk = [&](double diameter) {
    return DisksOfHole(Metres{diameter}, sensor_distance, subject).total.value;
  };
  const double best = LeastOf(disk, 1e-6, sensor_distance.value);
  return {Metres{best}, Metres{disk(best)}};
}

Lesson ConjugatesLesson() {
  constexpr double kReach = 300.0;  // mm
  const double f = kNormal.value * kMm;
  const auto image = [&](double z) {
    return thin_lens::ImageDepth(kNormal.value, thin_lens::AxialPlace<double>{z / kMm, 1.0}) * kMm;
  };
  io::Chart chart;
  chart.title = "image distance against object distance, " + LengthText(kNormal) + " lens";
  chart.x = {.label = "object distance Z_o", .unit = "mm", .low = 0.0, .high = kReach};
  chart.y = {.label = "image distance Z_i", .unit = "mm", .low = -kReach, .high = kReach};
  auto real = CurveOf(image, 1.02 * f, kReach), ghost = CurveOf(image, 0.001 * f, 0.98 * f);
  real.width = ghost.width = 2.4;
  ghost.label = "virtual images";
  ghost.dashed = true;
  chart.lines = {std::move(real), std::move(ghost)};
  chart.bars.push_back({.x_low = 0.0, .x_high = f, .colour = io::PaletteColour(1), .opacity = 0.08});
  chart.rules = {{.y = 0.0, .dashed = false}, {.x = f, .label = "Z_o = f"}, {.y = f, .label = "Z_i = f"}};
  chart.points.push_back({.points = {{{2.0 * f, image(2.0 * f)}, ""}}, .colour = io::PaletteColour(0), .size = 5.0});
  chart.notes.push_back({.at = {2.0 * f, image(2.0 * f)},
                         .text = "life size: both " + Short(image(2.0 * f)) + " mm",
                         .dx = 30.0,
                         .dy = -40.0});
  chart.notes.push_back({.at = {4.5 * f, image(4.5 * f)},
                         .text = "real images",
                         .dx = 20.0,
                         .dy = -30.0,
                         .colour = io::PaletteColour(0)});
  chart.legend = io::LegendPlace::None;
  chart.height = 440;
  return {.name = "conjugates",
          .topic = "thin lens law",
          .charts = {chart},
          .read =
              "How to read it: the solid branch is where a screen catches the image; below zero, for objects inside "
              "the focal length, the image is virtual and stands on the object's own side.",
          .means =
              "What it means: a far object is imaged at f whatever its distance, and toward the focal point the image "
              "runs away to infinity and comes back from behind."};
}

Lesson PinholeLesson() {
  constexpr Dioptres kSubject{0.5};
  constexpr double kLeast = 0.05, kMost = 2.0;  // mm
  const SharpestHole best = Sharpest(kNormal, kSubject);
  const auto part = [&](Metres HoleDisks::* disk) {
    return [=](double mm) { return (DisksOfHole(Metres{mm / kMm}, kNormal, kSubject).*disk).value * kUm; };
  };
  io::Chart chart;
  chart.title = "hole " + LengthText(kNormal) + " before its sensor, subject at " +
                LengthText(Metres{1.0 / kSubject.value}) + ", light of " + Nanometres(kGreen);
  chart.x = {.label = "diameter A of the hole", .unit = "mm", .scale = io::Scale::Log, .low = kLeast, .high = kMost};
  chart.y = {.label = "diameter of the disk", .unit = "um", .scale = io::Scale::Log};
  for (const auto& [disk, name] : {std::pair{&HoleDisks::total, "both together"},
                                   {&HoleDisks::geometric, "geometry: grows with A"},
                                   {&HoleDisks::diffraction, "diffraction: falls with A"}}) {
    auto line = CurveOf(part(disk), kLeast, kMost, io::Scale::Log);
    line.label = name;
    line.dashed = !chart.lines.empty();
    line.width = chart.lines.empty() ? 2.6 : 1.8;
    chart.lines.push_back(std::move(line));
  }
  const io::ChartPoint at{best.diameter.value * kMm, best.disk.value * kUm};
  chart.points.push_back({.points = {{at, ""}}, .colour = io::PaletteColour(0), .size = 5.0});
  chart.notes.push_back({.at = at,
                         .text = "sharpest: " + Short(at.y, 3) + " um at A = " + Short(at.x, 3) + " mm",
                         .dx = 20.0,
                         .dy = 70.0});
  chart.height = 400;
  return {.name = "pinhole",
          .topic = "pinhole",
          .charts = {chart},
          .read =
              "How to read it: a lower disk is a sharper picture; the thin dashed lines are its two causes, the thick "
              "line is both together.",
          .means =
              "What it means: a pinhole is sharpest where geometry and diffraction blur alike; a smaller hole makes "
              "the picture darker and softer at once."};
}

Lesson HoleAndLensLesson() {
  constexpr double kStop = 16.0, kNearest = 0.3, kFarthest = 30.0;
  constexpr Dioptres kFocus{0.5};
  const optics::ThinLens lens{kNormal, FNumber{kStop}, optics::Extension(kNormal, kFocus)};
  const Metres sensor = kNormal + lens.extension, opening = kNormal / kStop;
  const auto of_lens = [&](double z) { return optics::SignedBlur(lens, Metres{z}).value; };
  const auto of_hole = [&](double z) { return BlurOfHole(opening, sensor, {z, 1.0}); };
  const auto lit = [&](const Formula& blur) {
    return [&, blur](double z) {
      return thin_lens::LitBy<double>({0.0, 0.0, z, 1.0}, sensor.value, blur(z)).diameter * kMm;
    };
  };
  const auto seen = [&](const Formula& blur) {
    return [&, blur](double z) { return thin_lens::SeenFrom(0.0, 0.0, sensor.value, z, blur(z)).diameter * kMm; };
  };
  io::Chart forward, reverse;
  forward.title = "what a scene point lights";
  forward.y = {.label = "disk on the sensor", .unit = "mm", .scale = io::Scale::Log, .low = 1e-3, .high = 1e1};
  reverse.title = "what a sensor point sees";
  reverse.y = {.label = "disk in the scene", .unit = "mm", .scale = io::Scale::Log, .low = 1e-1, .high = 1e4};
  for (io::Chart* chart : {&forward, &reverse}) {
    const auto disk = [&](const Formula& blur) { return chart == &forward ? Formula(lit(blur)) : Formula(seen(blur)); };
    auto hole_line = CurveOf(disk(of_hole), kNearest, kFarthest, io::Scale::Log);
    auto lens_line = CurveOf(disk(of_lens), kNearest, kFarthest, io::Scale::Log);
    hole_line.label = "hole";
    lens_line.label = "lens";
    chart->lines = {std::move(hole_line), std::move(lens_line)};
    chart->x = {.label = "distance Z", .unit = "m", .scale = io::Scale::Log, .low = kNearest, .high = kFarthest};
    chart->rules.push_back({.x = 1.0 / kFocus.value, .label = "in focus"});
    chart->width = kHalfWidth;
    chart->height = 380;
  }
  return {
      .name = "hole-and-lens",
      .topic = "aperture without a lens: forward and reverse projection",
      .charts = {forward, reverse},
      .columns = 2,
      .read = "How to read it: both openings are " + LengthText(opening, 4) + " wide and " + LengthText(sensor, 4) +
              " before the sensor; left is the area of the sensor that a point at Z lights, right the area at Z that a "
              "sensor point sees.",
      .means =
          "What it means: without a lens no disk is smaller than the hole, with one it shrinks to nothing in "
          "focus; both views are the same rays, followed either way."};
}

Lesson RaysLesson() {
  constexpr Dioptres kFocus{0.5};
  constexpr FNumber kStop{2.8};
  constexpr Metres kHole{0.001};
  const optics::ThinLens lens{kNormal, kStop, optics::Extension(kNormal, kFocus)};
  const Metres sensor = kNormal + lens.extension;
  cli::RaySystem with_lens{.title = LengthText(kNormal) + " f/" + Short(kStop.value) + " focused at " +
                                    LengthText(Metres{1.0 / kFocus.value}),
                           .focal_length = kNormal,
                           .diameter = kNormal / kStop.value,
                           .sensor_distance = sensor,
                           .points = {}};
  cli::RaySystem without{.title = "the same sensor behind a hole without a lens",
                         .diameter = kHole,
                         .sensor_distance = sensor,
                         .points = {}};
  for (const double distance : {1.0, 2.0, 8.0}) {
    const Dioptres vergence{1.0 / distance};
    with_lens.points.push_back({.name = "point", .vergence = vergence, .blur = optics::Blur(lens, vergence)});
    if (distance == 2.0) continue;
    without.points.push_back(
        {.name = "point", .vergence = vergence, .blur = DisksOfHole(kHole, sensor, vergence).geometric});
  }
  Lesson lesson{
      .name = "rays",
      .topic = "thin lens, circle of confusion",
      .charts = {cli::RayDiagram(with_lens), cli::RayDiagram(without)},
      .read =
          "How to read it: from each point two rays pass the edges of the opening and one its centre; a thick "
          "bar on the sensor is the disk they leave there.",
      .means =
          "What it means: only for one distance do the rays meet on the sensor; nearer points would meet "
          "behind it, farther ones before it, and through a bare hole none ever meet."};
  for (io::Chart& chart : lesson.charts) {
    chart.subtitle = chart.captions.front();
    chart.width = kPageWidth;
  }
  return lesson;
}

std::vector<Lesson> Lessons() {
  return {PinholeLesson(),    HoleAndLensLesson(), ConjugatesLesson(),   RaysLesson(),
          SignedBlurLesson(), TiltedPlaneLesson(), DepthOfFieldLesson(), FNumberLesson()};
}

std::string SvgOf(const Lesson& lesson) {
  return io::ChartsSvg(lesson.charts, lesson.columns,
                       {"In the lecture: " + lesson.topic + ".", lesson.read, lesson.means});
}

}  // namespace lensd::bench
