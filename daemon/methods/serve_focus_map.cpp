// FocusMap: an autofocus run over a grid of regions, told as the interface's types.
#include <algorithm>
#include <numbers>

#include "daemon/methods/lens_service.h"
#include "daemon/methods/serve.h"
#include "daemon/wire/autofocus_request.h"
#include "daemon/wire/json_values.h"
#include "daemon/wire/lens_json.h"
#include "daemon/wire/target_json.h"

namespace lensd::daemon {
namespace {

using varlink::Json;

constexpr double kDegrees = 180.0 / std::numbers::pi;

Json OptionalNumber(const std::optional<double>& value, double scale = 1.0) {
  return value ? varlink::NumberOrNull(*value * scale) : Json(nullptr);
}

Json CellJson(const rig::FocusMapOutcome& map, std::size_t index) {
  const rig::FocusMapOutcome::Cell& cell = map.cells[index];
  const auto& [x, y, width, height] = cell.region;
  const auto& at = cell.found.position;
  const bool fitted = at && map.surface;
  const int number = static_cast<int>(index);
  return {{"column", number % map.grid.columns},
          {"row", number / map.grid.columns},
          {"region", {{"x", x}, {"y", y}, {"w", width}, {"h", height}}},
          {"x", x + 0.5 * width},
          {"y", y + 0.5 * height},
          {"cause", at ? "found" : AutofocusCauseName(cell.found.cause)},
          {"reason", cell.found.reason},
          {"position", cell.position ? NativeJson(cell.position->value) : Json(nullptr)},
          {"vergenceD", Optional(cell.vergence)},
          {"extensionUm", fitted ? Json((*at - map.best.value) * kUmPerMetre) : Json(nullptr)},
          {"sigmaUm", at ? Json(cell.found.sigma * kUmPerMetre) : Json(nullptr)},
          {"offUm", fitted ? Json(cell.found.off * kUmPerMetre) : Json(nullptr)},
          {"outlier", cell.found.outlier}};
}

Json TiltJson(const rig::FocusMapOutcome::Tilt& tilt) {
  return {{"riseUm", tilt.rise.value * kUmPerMetre},
          {"sigmaUm", tilt.sigma.value * kUmPerMetre},
          {"sensorDeg", OptionalNumber(tilt.sensor, kDegrees)},
          {"sensorSigmaDeg", OptionalNumber(tilt.sensor_sigma, kDegrees)},
          {"targetDeg", OptionalNumber(tilt.target, kDegrees)}};
}

Json SurfaceJson(const rig::FocusMapOutcome::Surface& surface) {
  return {{"across", TiltJson(surface.across)},
          {"down", TiltJson(surface.down)},
          {"curvatureUm", Optional(surface.curvature, kUmPerMetre)},
          {"curvatureSigmaUm", surface.curvature ? Json(surface.curvature_sigma.value * kUmPerMetre) : Json(nullptr)},
          {"scatterUm", surface.scatter.value * kUmPerMetre},
          {"leftUm", surface.left.value * kUmPerMetre},
          {"leftPx", OptionalNumber(surface.left_px)},
          {"used", surface.used}};
}

Json FocusMapJson(const std::string& name, const rig::AutofocusOutcome& outcome, const autofocus::MapGrid& grid) {
  Json cells = Json::array();
  for (std::size_t i = 0; outcome.map && i < outcome.map->cells.size(); ++i) cells.push_back(CellJson(*outcome.map, i));
  const bool fitted = outcome.focused && outcome.map && outcome.map->surface;
  return {{"lens", name},
          {"mapped", outcome.focused},
          {"cause", outcome.focused ? "found" : AutofocusCauseName(outcome.cause)},
          {"reason", outcome.reason},
          {"columns", grid.columns},
          {"rows", grid.rows},
          {"cells", std::move(cells)},
          {"surface", fitted ? SurfaceJson(*outcome.map->surface) : Json(nullptr)},
          {"magnification", fitted ? Json(outcome.map->magnification) : Json(nullptr)},
          {"frames", outcome.frames},
          {"moves", outcome.moves},
          {"elapsedMs", Milliseconds(outcome.elapsed)},
          {"position", NativeJson(outcome.position.value)},
          {"vergenceD", Optional(outcome.vergence)}};
}

/// A number of columns or rows; what is no such number is as wrong as too many.
int CountOf(const Json& parameters, std::string_view key, int otherwise) {
  const Json* given = Given(parameters, key);
  if (given == nullptr) return otherwise;
  const auto count = given->get<std::int64_t>();
  return static_cast<int>(std::clamp<std::int64_t>(count, 0, autofocus::MapGrid::kMost + 1));
}

void FocusMap(ServedLens& lens, const ExchangePointer& exchange) {
  Result<rig::AutofocusRequest> request = AutofocusRequestOf(exchange->parameters());
  if (!request) return Refuse(exchange, lens, request.error());
  autofocus::MapGrid grid;
  grid.columns = CountOf(exchange->parameters(), "columns", grid.columns);
  grid.rows = CountOf(exchange->parameters(), "rows", grid.rows);
  request->map = grid;
  RunAutofocus(lens, exchange, *std::move(request), [&lens, exchange, grid](const rig::AutofocusOutcome& outcome) {
    exchange->Finish(Wrap("map", varlink::WriteJson(FocusMapJson(lens.name(), outcome, grid))));
  });
}

}  // namespace

MethodTable FocusMapMethods(LensService& service) {
  return {{"FocusMap", service.ForLens(FocusMap)}};
}

}  // namespace lensd::daemon
