// lensctl conjugate: where the thin lens images a point.

#include <CLI/CLI.hpp>
#include <array>
#include <memory>

#include "cli/charts/chart_file.h"
#include "cli/charts/ray_diagram.h"
#include "cli/commands.h"
#include "cli/lens_options.h"
#include "cli/offline/point.h"
#include "cli/text/text.h"
#include "varlink/json.h"

namespace lensd::cli {
namespace {

struct ConjugateText {
  std::string focal_length;
  std::string point;
  PlotText plot;
};

/// The thin lens, the point and its image. A point in the plane of the lens has no way to go.
std::expected<void, Failure> Draw(const PlotText& plot, double f, const std::array<double, 4>& point) {
  const auto& [x, y, z, w] = point;
  if (z == 0.0) return Refuse(Exit::Usage, "--plot: a point in the plane of the lens is its own image; no ray is left");
  const RaySystem system{.title = LengthText(Metres{f}, 4) + " lens: a point and its image",
                         .focal_length = Metres{f},
                         .points = {{.name = "object", .vergence = {w / z}, .off_axis = x != 0.0 || y != 0.0}}};
  return WritePlot(plot, io::ChartSvg(RayDiagram(system)));
}

Outcome RunConjugate(const ConjugateText& text, Session& session) {
  if (auto good = CheckPlot(text.plot); !good) return PassOn(good);
  const auto f = ParseFocalLength(text.focal_length);
  if (!f) return PassOn(f);
  const auto object = ParsePoint(text.point, "--point");
  if (!object) return PassOn(object);
  if (session.globals().from.value_or(From::Lens) != From::Lens) {
    return Refuse(Exit::Usage, "conjugate works with points from the lens centre; leave --from out");
  }
  const auto image = optics::thin_lens::Conjugate(f->ToRational(), *object);
  const bool finite = !image[3].is_zero();
  std::array<double, 4> point{};
  std::array<double, 3> image_mm{};
  for (std::size_t i = 0; i < 4; ++i) {
    const auto value = Rounded(image[i]);
    if (!value) return PassOn(value);
    point[i] = *value;
    if (i == 3 || !finite) continue;
    const auto millimetres = Rounded(image[i] * 1000 / image[3]);
    if (!millimetres) return PassOn(millimetres);
    image_mm[i] = *millimetres;
  }
  if (text.plot.wanted()) {
    std::array<double, 4> from{};
    for (std::size_t i = 0; i < 4; ++i) from[i] = Rounded((*object)[i]).value_or(0.0);
    if (auto drawn = Draw(text.plot, f->Nearest().value_or(0.0), from); !drawn) return PassOn(drawn);
  }
  if (session.json()) {
    session.PrintJson({{"point", point}, {"imageMm", finite ? varlink::Json(image_mm) : varlink::Json(nullptr)}});
    return Exit::Done;
  }
  if (!finite) {
    session.PrintText("image at infinity, in direction (" + Short(point[0]) + ", " + Short(point[1]) + ", " +
                      Short(point[2]) + ")");
    return Exit::Done;
  }
  session.PrintText((image_mm[2] < 0.0 ? "virtual image at (" : "image at (") + Short(image_mm[0], 6) + ", " +
                    Short(image_mm[1], 6) + ", " + Short(image_mm[2], 6) +
                    ") mm behind the lens centre, axes opposite to the object's");
  return Exit::Done;
}

}  // namespace

void AddConjugate(CLI::App& root, Run& run) {
  auto text = std::make_shared<ConjugateText>();
  CLI::App* command = root.add_subcommand("conjugate", "where a thin lens images a point")->group(kOffline);
  command->add_option("--focal-length", text->focal_length, "focal length, such as 50mm")->required()->type_name("F");
  command
      ->add_option("--point", text->point,
                   "X,Y,Z as lengths from the lens centre (Z may be inf), or X,Y,Z,W as plain numbers in metres")
      ->required()
      ->type_name("POINT");
  AddPlotOptions(*command, text->plot, "the path of the light from the point to its image");
  command->callback([text, &run] { run = [text](Session& session) { return RunConjugate(*text, session); }; });
}

}  // namespace lensd::cli
