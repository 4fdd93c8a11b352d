#include "cli/online/plan.h"

#include <cmath>
#include <limits>
#include <utility>

#include "cli/online/lens_info.h"
#include "cli/online/link.h"
#include "cli/online/texts.h"
#include "cli/plan/answer_text.h"
#include "cli/plan/plot.h"
#include "io/svg.h"
#include "proto/plan_json.h"

namespace lensd::cli {
namespace {

using proto::Json;

double Value(const Json& object, const char* key, double scale = 1.0) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number()) return std::numeric_limits<double>::quiet_NaN();
  return found->get<double>() * scale;
}

optics::LimitAnswer LimitOf(const Json& json) {
  return {.name = json.value("name", ""),
          .near = {Value(json, "nearD")},
          .far = {Value(json, "farD")},
          .limit = {Value(json, "limitUm", 1e-6)},
          .worst = {Value(json, "worstUm", 1e-6)},
          .at = {Value(json, "atD")},
          .ratio = Value(json, "ratio")};
}

/// The daemon's answer as the planner gave it, for the same words as offline.
optics::PlanAnswer AnswerOf(const Json& json) {
  optics::PlanAnswer answer;
  answer.feasible = json.value("feasible", false) || json.contains("fNumber");
  answer.note = json.value("note", "");
  if (!answer.feasible) {
    answer.conflict = json.value("conflict", std::vector<std::string>{});
    if (const double relax = Value(json, "relax"); std::isfinite(relax)) answer.relax = relax;
    return answer;
  }
  answer.f_number = {Value(json, "fNumber")};
  answer.extension = {Value(json, "extensionMm", 1e-3)};
  answer.aperture_diameter = {Value(json, "apertureDiameterMm", 1e-3)};
  answer.sensor_distance = {Value(json, "sensorDistanceMm", 1e-3)};
  answer.focal_plane = {Value(json, "focalPlaneD")};
  answer.magnification = Value(json, "magnification");
  answer.working_f_number = {Value(json, "workingFNumber")};
  answer.worst_ratio = Value(json, "worstRatio");
  answer.model = json.value("model", "");
  answer.model_error = {Value(json, "modelErrorUm", 1e-6)};
  for (const Json& limit : json.value("limits", Json::array())) answer.limits.push_back(LimitOf(limit));
  if (const auto depth = json.find("depthOfField"); depth != json.end() && depth->is_object()) {
    answer.depth_of_field = optics::DepthInterval{optics::PlanDepth::Vergence(Value(*depth, "nearD")),
                                                  optics::PlanDepth::Vergence(Value(*depth, "farD"))};
  }
  return answer;
}

void Print(Session& session, const Json& reply, Metres principal_gap) {
  const Json& plan = reply["plan"];
  const Json applied = reply.value("applied", Json());
  if (session.json()) {
    Json merged = plan;
    for (const char* key : {"applied", "reached", "nearest"}) {
      if (reply.contains(key)) merged[key] = reply[key];
    }
    return session.PrintJson(merged);
  }
  session.PrintText(PlanAnswerText(AnswerOf(plan), principal_gap));
  if (reply.contains("nearest")) session.PrintText(PlanAnswerText(AnswerOf(reply["nearest"]), principal_gap));
  for (const Json& move : applied) session.PrintText(MoveText(move));
}

/// Done when there is a plan and, where it was applied, every axis reached it.
Exit StatusOf(const Json& reply) {
  bool good = reply["plan"].value("feasible", false);
  for (const Json& move : reply.value("applied", Json())) good &= move.value("reached", false);
  if (reply.contains("reached")) good &= reply["reached"].value("feasible", false);
  return good ? Exit::Done : Exit::No;
}

}  // namespace

Outcome RunPlanOnline(const PlanText& text, const std::string& lens, bool apply, Session& session) {
  auto link = Link::Open(session);
  if (!link) return std::unexpected(link.error());
  const auto info = FindInfo(*link, lens);
  if (!info) return std::unexpected(info.error());
  const auto question = ReadPlan(text, DefaultsOf(*info), OriginOf(session, *info));
  if (!question) return Refuse(question);
  Json request = proto::PlanRequestJson(question->request);
  // What the user does not say about the motors the daemon knows.
  if (text.sensor_tolerance.empty()) request.erase("sensorToleranceUm");
  if (text.f_number_tolerance.empty()) request.erase("fNumberTolerance");
  const Json name = (*info)["name"];
  Json parameters{{"lens", name}, {"request", std::move(request)}, {"apply", apply}};
  const auto reply = apply ? link->Follow(
                                 MethodOfLens("Plan"), std::move(parameters), [](const Json&) { return true; },
                                 [&] { StopNow(session, name, nullptr); })
                           : link->Ask(MethodOfLens("Plan"), std::move(parameters));
  if (!reply) return std::unexpected(reply.error());
  if (!text.plot.empty()) {
    const auto drawn = io::WriteSvg(text.plot, PlanPlot(question->request, AnswerOf((*reply)["plan"])));
    if (!drawn) return Refuse(drawn);
  }
  Print(session, *reply, question->principal_gap);
  return StatusOf(*reply);
}

}  // namespace lensd::cli
