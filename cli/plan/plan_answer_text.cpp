// A plan's answer as a table and sentences, the same offline and for a lens of the daemon.
#include "cli/plan/plan_answer_text.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "cli/text/text.h"

namespace lensd::cli {
namespace {

std::string Joined(const std::vector<std::string>& names) {
  std::string joined;
  for (std::size_t i = 0; i < names.size(); ++i) joined += (i == 0 ? "" : ", ") + names[i];
  return joined;
}

/// What to lift, one thing a line where there is a choice.
std::string Causes(const std::vector<optics::PlanCause>& causes) {
  if (causes.empty()) return "No setting meets all of this. ";
  if (causes.size() == 1) return "Possible but for " + causes.front().reason + ".\n";
  std::string text = "Possible but for any one of these:\n";
  for (const optics::PlanCause& cause : causes) text += "- " + cause.reason + "\n";
  return text;
}

std::string Infeasible(const optics::PlanAnswer& answer) {
  std::string text = Causes(answer.causes) + "In conflict: " + Joined(answer.conflict) +
                     "; dropping any one of them leaves the rest possible.\n";
  if (answer.relax) {
    text += "With every sharp limit multiplied and every blurred one divided by " + Short(*answer.relax, 6) +
            " it becomes possible.\n";
  } else {
    text += "No change of the blur limits alone makes it possible.\n";
  }
  return text;
}

/// Where all limits have one unit, it stands above their column.
std::string LimitTable(const std::vector<std::string>& names, const std::vector<optics::LimitAnswer>& limits,
                       const BlurUnits& units) {
  const auto in_pixels = [&](const std::string& name) { return units.in_pixels.contains(name); };
  const auto pixels = std::ranges::count_if(names, in_pixels);
  const bool mixed = pixels > 0 && std::cmp_less(pixels, names.size());
  const std::string unit = mixed ? "" : pixels > 0 ? " [px]" : " [um]";
  const auto blur = [&](const std::string& name, Metres size) {
    const std::string number = Short(size.value / (in_pixels(name) ? units.pixel->value : 1e-6));
    return number + (!mixed ? "" : in_pixels(name) ? " px" : " um");
  };
  std::vector<std::vector<std::string>> rows{{"limit", "from", "to", "limit" + unit, "worst" + unit, "at", "used"}};
  for (std::size_t k = 0; k < limits.size(); ++k) {
    const auto& [name, limit] = std::tie(names.at(k), limits[k]);
    rows.push_back({name, DepthText(limit.near), DepthText(limit.far), blur(name, limit.limit), blur(name, limit.worst),
                    DepthText(limit.at), Short(100.0 * limit.ratio) + " %"});
  }
  return TableText(rows);
}

}  // namespace

std::vector<std::string> NamesOf(const optics::PlanRequest& request) {
  std::vector<std::string> names;
  names.reserve(request.limits.size());
  for (const optics::BlurLimit& limit : request.limits) names.push_back(limit.name);
  return names;
}

std::string PlanAnswerText(const std::vector<std::string>& names, const optics::PlanAnswer& answer,
                           const BlurUnits& units, Metres principal_gap) {
  const std::string note = answer.note.empty() ? "" : "Note: " + answer.note + "\n";
  if (!answer.feasible) return Infeasible(answer) + note;
  std::vector<std::vector<std::string>> rows{
      {"f-number", "f/" + Short(answer.f_number.value, 6), "opening " + LengthText(answer.aperture_diameter)},
      {"extension", LengthText(answer.extension),
       "sensor " + LengthText(answer.sensor_distance) + " from the lens centre"},
      {"focal plane", DepthText(answer.focal_plane),
       answer.focal_plane.value > 0.0
           ? DistanceText(Metres{1.0 / answer.focal_plane.value} + answer.sensor_distance + principal_gap) +
                 " from the sensor"
           : ""},
      {"magnification", Short(answer.magnification), "working f-number " + Short(answer.working_f_number.value)},
      {"model", answer.model,
       "leaves out at most " + LengthText(answer.model_error) + (answer.diffraction ? " of geometric blur" : "")}};
  if (answer.diffraction) {
    rows.push_back({"diffraction", LengthText(*answer.diffraction), "at 550 nm, in no limit: --wavelength counts it"});
  }
  if (answer.depth_of_field) {
    rows.push_back({"sharp", DepthText(answer.depth_of_field->one_end.vergence()),
                    "to " + DepthText(answer.depth_of_field->other_end.vergence())});
  }
  std::string text = TableText(rows);
  if (!answer.limits.empty()) text += "\n" + LimitTable(names, answer.limits, units);
  return text + std::string(OriginLine()) + note;
}

}  // namespace lensd::cli
