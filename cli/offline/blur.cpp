// lensctl blur: the blur of points at given depths, under one of the camera models.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include "cli/charts/chart_file.h"
#include "cli/charts/ray_diagram.h"
#include "cli/commands.h"
#include "cli/offline/blur_chart.h"
#include "cli/offline/camera_system.h"
#include "cli/text/text.h"
#include "varlink/json.h"

namespace lensd::cli {
namespace {

struct BlurText {
  SystemText system;
  std::vector<std::string> at;
  PlotText plot, rays;
};

/// One row of the answer.
struct BlurAt {
  Depth object;                    // from the lens centre
  double blur_um = 0.0;            // diffraction included where the model has it
  double signed_blur_um = 0.0;     // geometric: positive behind the focal plane
  std::optional<double> image_mm;  // nothing where no lens forms an image, or it is at infinity
};

struct BlurTable {
  CameraSystem system;
  std::vector<BlurAt> rows;
  std::optional<double> pixel_um;
};

Result<std::optional<double>> ImageDistance(const CameraSystem& system, const Place& at) {
  if (!system.focal_length) return std::nullopt;
  const Rational f = system.focal_length->ToRational();
  if (optics::thin_lens::BeyondFocalPoint(f, at).is_zero()) return std::nullopt;
  const auto distance = Rounded(optics::thin_lens::ImageDepth(f, at) * 1000);
  if (!distance) return PassOn(distance);
  return *distance;
}

Result<BlurAt> RowAt(const CameraSystem& system, const Depth& object, std::optional<From> from) {
  const auto centred = system.FromCentre(object, from);
  if (!centred) return PassOn(centred);
  const Place at = PlaceOf(*centred);
  const Rational geometric = system.SignedBlur(at);
  const auto signed_blur = Rounded(geometric * 1'000'000);
  if (!signed_blur) return PassOn(signed_blur);
  BlurAt row{*centred, std::abs(*signed_blur), *signed_blur, std::nullopt};
  if (system.wavelength) {
    const auto disk = system.BlurDisk(geometric);
    if (!disk) return PassOn(disk);
    row.blur_um = *disk * 1e6;
  }
  const auto image = ImageDistance(system, at);
  if (!image) return PassOn(image);
  row.image_mm = *image;
  return row;
}

/// The row of the plane in focus, where it lies between two others: there blur is least.
Result<std::optional<BlurAt>> Sharpest(const CameraSystem& system, const BlurAt& near, const BlurAt& far) {
  if (!system.focal_length || !(near.signed_blur_um < 0.0) || !(far.signed_blur_um > 0.0)) return std::nullopt;
  const Rational f = system.focal_length->ToRational();
  const auto vergence = Rounded(optics::thin_lens::FocalPlane<Rational>(f, system.sensor_distance - f));
  if (!vergence) return PassOn(vergence);
  auto row = RowAt(system, {Depth::Form::Vergence, *vergence, Decimal::Shortest(*vergence)}, From::Lens);
  const auto least = row ? system.BlurDisk(0) : Result<double>(0.0);
  if (!row || !least) return PassOn(row ? least.error() : row.error());
  row->signed_blur_um = 0.0;  // not what rounding the vergence left of it
  row->blur_um = *least * 1e6;
  return *row;
}

/// One depth is a row; a range is its two ends, and the plane in focus between them.
Result<void> AddRows(const CameraSystem& system, const std::string& text, std::optional<From> from, BlurTable& table) {
  if (text.find("..") == text.npos) {
    const auto object = ParseObject(text, "--at");
    if (!object) return PassOn(object);
    const auto row = RowAt(system, *object, from);
    if (!row) return PassOn(row);
    table.rows.push_back(*row);
    return {};
  }
  const auto range = ParseDepthRange(text, "--at");
  if (!range) return PassOn(range);
  const auto near = RowAt(system, range->near, from);
  const auto far = near ? RowAt(system, range->far, from) : near;
  if (!far) return PassOn(far);
  const auto sharpest = Sharpest(system, *near, *far);
  if (!sharpest) return PassOn(sharpest);
  table.rows.push_back(*near);
  if (*sharpest) table.rows.push_back(**sharpest);
  table.rows.push_back(*far);
  return {};
}

Result<BlurTable> Compute(const BlurText& text, std::optional<From> from) {
  const auto system = ReadSystem(text.system, from);
  if (!system) return PassOn(system);
  const auto pixel = ParsePixel(text.system.pixel);
  if (!pixel) return PassOn(pixel);
  BlurTable table{.system = *system, .rows = {}, .pixel_um = std::nullopt};
  if (*pixel) table.pixel_um = (*pixel)->Nearest().value() * 1e6;
  for (const std::string& at : text.at) {
    if (const auto added = AddRows(*system, at, from, table); !added) return PassOn(added);
  }
  return table;
}

varlink::Json RowJson(const BlurAt& row, std::optional<double> pixel_um) {
  const double vergence = row.object.Vergence().value;
  varlink::Json json{{"distanceM", row.object.IsDistance() ? varlink::Json(row.object.value)
                                   : vergence > 0.0        ? varlink::NumberOrNull(1.0 / vergence)
                                                           : varlink::Json(nullptr)},
                     {"vergenceD", vergence},
                     {"blurUm", row.blur_um},
                     {"signedBlurUm", row.signed_blur_um},
                     {"imageDistanceMm", row.image_mm ? varlink::Json(*row.image_mm) : varlink::Json(nullptr)}};
  if (pixel_um) json["blurPx"] = row.blur_um / *pixel_um;
  return json;
}

std::string TextOf(const BlurTable& table) {
  std::vector<std::vector<std::string>> cells{{"subject", "blur [um]", "signed [um]", "image at [mm]"}};
  if (table.pixel_um) cells[0].emplace_back("blur [px]");
  for (const BlurAt& row : table.rows) {
    cells.push_back({DepthText(row.object.Vergence()), Short(row.blur_um), Short(row.signed_blur_um),
                     row.image_mm ? Short(*row.image_mm, 6) : "none"});
    if (table.pixel_um) cells.back().push_back(Short(row.blur_um / *table.pixel_um));
  }
  return TableText(cells);
}

/// The curve around the rows, and each row on it.
Result<io::Chart> ChartOf(const BlurTable& table) {
  constexpr double kMargin = 0.15;
  constexpr std::size_t kMostLabels = 12;  // more would cover the curve
  const BlurUnit unit{table.pixel_um};
  io::ChartPoints points{.name = "asked for", .colour = io::PaletteColour(1)};
  double far = table.rows.front().object.Vergence().value, near = far;
  for (const BlurAt& row : table.rows) {
    const double vergence = row.object.Vergence().value, blur = unit.Of(row.blur_um);
    far = std::min(far, vergence);
    near = std::max(near, vergence);
    const bool labelled = table.rows.size() <= kMostLabels && blur > 0.0;  // where it is 0 the rule says so
    points.points.push_back({{vergence, blur}, labelled ? Short(blur, 3) + " " + unit.Name() : ""});
  }
  const double span = near > far ? near - far : std::max(near, 0.2);
  auto chart =
      BlurOverDepth(table.system, Dioptres{std::max(far - kMargin * span, 0.0)}, Dioptres{near + kMargin * span}, unit);
  if (!chart) return chart;
  chart->title = SystemName(table.system) + ": blur over depth";
  chart->subtitle = table.system.wavelength ? "with diffraction" : "geometric; straight over vergence, 1/distance";
  chart->points.push_back(std::move(points));
  return chart;
}

/// The nearest row, the farthest, and the sharpest of all: more would cover each other.
RaySystem RaysOf(const BlurTable& table) {
  const auto vergence = [](const BlurAt& row) { return row.object.Vergence().value; };
  const auto sharpness = [](const BlurAt& row) { return -std::abs(row.signed_blur_um); };
  const auto nearest = std::ranges::max_element(table.rows, {}, vergence);
  const auto sharpest = std::ranges::max_element(table.rows, {}, sharpness);
  const auto farthest = std::ranges::min_element(table.rows, {}, vergence);
  const CameraSystem& camera = table.system;
  RaySystem system{
      .title = SystemName(camera) + ": the way of the light",
      .diameter = Metres{camera.model == CameraModel::Pinhole ? 0.0 : Rounded(camera.diameter).value_or(0.0)},
      .sensor_distance = Metres{Rounded(camera.sensor_distance).value_or(0.0)}};
  if (camera.focal_length) system.focal_length = Metres{camera.focal_length->Nearest().value_or(0.0)};
  std::set<const BlurAt*> seen;
  for (const auto& row : {nearest, sharpest, farthest}) {
    if (!seen.insert(&*row).second) continue;
    system.points.push_back(
        {.name = "subject", .vergence = row->object.Vergence(), .blur = Metres{row->blur_um * 1e-6}});
  }
  return system;
}

Outcome RunBlur(const BlurText& text, Session& session) {
  if (auto good = CheckPlots(text.plot, text.rays); !good) return PassOn(good);
  const auto table = Compute(text, session.globals().from);
  if (!table) return PassOn(table);
  if (text.plot.wanted()) {
    const auto chart = ChartOf(*table);
    if (!chart) return PassOn(chart);
    if (auto drawn = WritePlot(text.plot, io::ChartSvg(*chart)); !drawn) return PassOn(drawn);
  }
  if (text.rays.wanted()) {
    const std::string svg = io::ChartSvg(RayDiagram(RaysOf(*table)));
    if (auto drawn = WritePlot(RaysInTheme(text.plot, text.rays), svg); !drawn) return PassOn(drawn);
  }
  if (!session.json()) {
    session.PrintText(TextOf(*table) + std::string(OriginLine()));
    return Exit::Done;
  }
  varlink::Json answer = varlink::Json::array();
  for (const BlurAt& row : table->rows) answer.push_back(RowJson(row, table->pixel_um));
  session.PrintJson(answer);
  return Exit::Done;
}

}  // namespace

void AddBlur(CLI::App& root, Run& run) {
  auto text = std::make_shared<BlurText>();
  CLI::App* command = root.add_subcommand("blur", "blur of points at given depths")->group(kOffline);
  AddSystemOptions(*command, text->system);
  AddHyperfocalOptions(*command, text->system);
  command
      ->add_option("--at", text->at,
                   "distance or vergence of a point, or a range A..B, which gives its ends and the plane in focus "
                   "between them; may be repeated")
      ->required()
      ->allow_extra_args(false)
      ->type_name("D");
  AddPlotOptions(*command, text->plot, "blur over depth, and what --at asks for on the curve");
  AddRaysOption(*command, text->rays);
  command->callback([text, &run] { run = [text](Session& session) { return RunBlur(*text, session); }; });
}

}  // namespace lensd::cli
