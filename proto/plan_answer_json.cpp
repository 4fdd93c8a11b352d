// What a planner answers, written straight into text.
#include <cmath>
#include <numbers>

#include "optics/light.h"
#include "optics/thin_lens.h"
#include "proto/plan_json.h"
#include "varlink/json_writer.h"

namespace lensd::proto {
namespace {

using Writer = varlink::JsonWriter;

void WriteLimit(Writer& writer, const std::string& name, const optics::LimitAnswer& limit) {
  writer.Begin();
  writer.Text("name", name);
  writer.Number("nearD", limit.near.value);
  writer.Number("farD", limit.far.value);
  writer.Number("limitUm", limit.limit.value * 1e6);
  writer.Number("worstUm", limit.worst.value * 1e6);
  writer.Number("atD", limit.at.value);
  writer.Number("ratio", limit.ratio);
  writer.End();
}

void WriteSetting(Writer& writer, const optics::PlanRequest& request, const optics::PlanAnswer& answer,
                  Metres principal_gap) {
  const double vergence = answer.focal_plane.value;
  const double distance = vergence > 0.0 ? 1.0 / vergence : NAN;
  writer.Number("fNumber", answer.f_number.value);
  writer.Number("focalLengthMm", answer.focal_length.value * 1e3);
  writer.Number("apertureDiameterMm", answer.aperture_diameter.value * 1e3);
  writer.Number("workingFNumber", answer.working_f_number.value);
  writer.Number("tStop", answer.working_f_number.value);
  writer.Number("lightParaxial", optics::thin_lens::ParaxialLight(answer.working_f_number.value));
  writer.Number("lightExact", optics::thin_lens::ExactLight(answer.working_f_number.value));
  writer.Number("subtendedAngleDeg", optics::SubtendedAngle(answer.working_f_number) * 180.0 / std::numbers::pi);
  writer.Number("magnification", answer.magnification);
  writer.Number("extensionMm", answer.extension.value * 1e3);
  writer.Number("sensorDistanceMm", answer.sensor_distance.value * 1e3);
  writer.Number("focalPlaneD", vergence);
  writer.Number("focalPlaneM", distance);
  writer.Number("focusFromSensorM", distance + answer.sensor_distance.value + principal_gap.value);
  writer.Number("worstRatio", answer.worst_ratio);
  writer.Text("model", answer.model);
  writer.Number("modelErrorUm", answer.model_error.value * 1e6);
  if (answer.diffraction) writer.Number("diffractionUm", answer.diffraction->value * 1e6);
  writer.BeginArray("limits");
  for (std::size_t k = 0; k < answer.limits.size(); ++k) {
    WriteLimit(writer, request.limits.at(k).name, answer.limits[k]);
  }
  writer.EndArray();
  if (!answer.depth_of_field) return;
  const double one = answer.depth_of_field->one_end.vergence().value;
  const double other = answer.depth_of_field->other_end.vergence().value;
  writer.BeginObject("depthOfField");
  writer.Number("nearD", std::max(one, other));
  writer.Number("farD", std::min(one, other));
  writer.End();
}

void WriteConflict(Writer& writer, const optics::PlanAnswer& answer) {
  writer.BeginArray("conflict");
  for (const std::string& name : answer.conflict) writer.Element(name);
  writer.EndArray();
  writer.BeginArray("causes");
  for (const optics::PlanCause& cause : answer.causes) {
    writer.Begin();
    writer.Text("cause", cause.cause);
    writer.Text("reason", cause.reason);
    writer.End();
  }
  writer.EndArray();
  writer.Number("relax", answer.relax.value_or(NAN));
  if (!answer.relax) return;
  writer.BeginObject("relaxed");
  writer.Number("fNumber", answer.f_number.value);
  writer.Number("extensionMm", answer.extension.value * 1e3);
  writer.Number("focalPlaneD", answer.focal_plane.value);
  writer.End();
}

}  // namespace

std::string PlanAnswerText(const optics::PlanRequest& request, const optics::PlanAnswer& answer, Metres principal_gap,
                           PlanShows shows) {
  Writer writer;
  writer.Begin();
  writer.Flag("feasible", answer.feasible);
  if (!answer.note.empty()) writer.Text("note", answer.note);
  if (answer.feasible || shows == PlanShows::Setting) {
    WriteSetting(writer, request, answer, principal_gap);
  } else {
    WriteConflict(writer, answer);
  }
  writer.End();
  return writer.Take();
}

varlink::Json PlanAnswerJson(const optics::PlanRequest& request, const optics::PlanAnswer& answer,
                             Metres principal_gap) {
  return varlink::ParseJson(PlanAnswerText(request, answer, principal_gap)).value();
}

}  // namespace lensd::proto
