// `lensctl plan` of a lens that the daemon knows: the request goes there as it was typed, and only the answer is drawn
// here.
#include "cli/online/plan/plan.h"

#include <cmath>
#include <limits>
#include <utility>

#include "cli/link/daemon_client.h"
#include "cli/link/drive.h"
#include "cli/link/lens_info.h"
#include "cli/online/plan/plan_request.h"
#include "cli/plan/plan_answer_text.h"
#include "cli/plan/plot.h"
#include "cli/plan/rays.h"
#include "cli/plan/reading.h"
#include "cli/plan/stack_answer.h"
#include "cli/plan/stack_plot.h"
#include "cli/text/text.h"
#include "cli/text/texts.h"
#include "io/svg.h"
#include "proto/plan_json.h"
#include "varlink/json_view.h"

namespace lensd::cli {
namespace {

using varlink::Json;

double Value(const Json& object, const char* key, double scale = 1.0) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number()) return std::numeric_limits<double>::quiet_NaN();
  return found->get<double>() * scale;
}

optics::LimitAnswer LimitOf(const Json& json) {
  return {.near = {Value(json, "nearD")},
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
    for (const Json& cause : json.value("causes", Json::array())) {
      answer.causes.push_back({cause.value("cause", ""), cause.value("reason", "")});
    }
    if (const double relax = Value(json, "relax"); std::isfinite(relax)) answer.relax = relax;
    if (const auto relaxed = json.find("relaxed"); relaxed != json.end() && relaxed->is_object()) {
      answer.f_number = {Value(*relaxed, "fNumber")};
      answer.extension = {Value(*relaxed, "extensionMm", 1e-3)};
      answer.focal_plane = {Value(*relaxed, "focalPlaneD")};
    }
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
  if (json.contains("diffractionUm")) answer.diffraction = Metres{Value(json, "diffractionUm", 1e-6)};
  for (const Json& limit : json.value("limits", Json::array())) answer.limits.push_back(LimitOf(limit));
  if (const auto depth = json.find("depthOfField"); depth != json.end() && depth->is_object()) {
    answer.depth_of_field = optics::DepthInterval{optics::PlanDepth::Vergence(Value(*depth, "nearD")),
                                                  optics::PlanDepth::Vergence(Value(*depth, "farD"))};
  }
  return answer;
}

/// The distance between the principal planes, which the daemon counts in what it says of distances from the sensor.
Metres PrincipalGap(const Json& plan) {
  const double gap =
      Value(plan, "focusFromSensorM") - Value(plan, "focalPlaneM") - Value(plan, "sensorDistanceMm", 1e-3);
  constexpr double kRounding = 1e-12;
  return Metres{gap > kRounding ? gap : 0.0};
}

std::string Words(const Json& plan, const BlurUnits& units) {
  if (plan.contains("shots")) return StackText(plan);
  std::vector<std::string> names;
  for (const Json& limit : plan.value("limits", Json::array())) names.push_back(limit.value("name", ""));
  std::string text = PlanAnswerText(names, AnswerOf(plan), units, PrincipalGap(plan));
  if (plan.contains("zoomPosition")) {
    text = "focal length " + LengthText(Metres{Value(plan, "focalLengthMm", 1e-3)}) + "\n" + text;
  }
  return text;
}

void Print(Session& session, const Json& reply, const BlurUnits& units) {
  const Json& plan = reply["plan"];
  const Json applied = reply.value("applied", Json());
  if (session.json()) {
    Json merged = plan;
    for (const char* key : {"applied", "reached", "nearest"}) {
      if (reply.contains(key)) merged[key] = reply[key];
    }
    return session.PrintJson(merged);
  }
  session.PrintText(Words(plan, units));
  if (reply.contains("nearest")) session.PrintText(Words(reply["nearest"], units));
  for (const Json& move : applied) session.PrintText(MoveText(move));
}

/// What is drawn of a plan shows the lens as it is at the position chosen, where its f-number is f(e)/A.
std::expected<void, Failure> Draw(const PlanText& text, const Json& reply, const std::string& lens) {
  const auto written = varlink::Document::Parse(varlink::WriteJson(reply["request"]));
  if (!written) return PassOn(written);
  const auto request = proto::PlanRequestFromJson(written->root(), {});
  if (!request) return PassOn(request);
  optics::PlanAnswer answer = AnswerOf(reply["plan"]);
  if (answer.feasible) answer.f_number = FNumber{request->focal_length.value / answer.aperture_diameter.value};
  if (auto drawn = WritePlot(text.plot, PlanPlot(*request, answer, lens)); !drawn) return drawn;
  if (!text.rays.wanted()) return {};
  return WriteRays(text, PlanRays(*request, answer, lens, PrincipalGap(reply["plan"])));
}

/// A stack has no chart of settings, and what has no shots none at all.
std::expected<void, Failure> DrawReply(const PlanText& text, const Json& reply, const std::string& lens) {
  if (!text.plot.wanted() && !text.rays.wanted()) return {};
  if (!text.stack) return Draw(text, reply, lens);
  if (!reply["plan"].value("feasible", false)) return {};
  return WritePlot(text.plot, io::ChartSvg(StackChart(reply["plan"], lens)));
}

/// The pixel is the one typed, else the camera's.
BlurUnits TypedUnits(const PlanText& text, const Json& info) {
  const auto limits = NamedLimits(text);
  if (!limits) return {};
  std::optional<Metres> pixel;
  const Json camera = info.value("camera", Json());
  if (camera.is_object() && camera["pixelUm"].is_number()) pixel = Metres{camera["pixelUm"].get<double>() * 1e-6};
  const auto typed = ParsePositiveLength(text.pixel, "--pixel");
  if (!text.pixel.empty() && typed) pixel = Metres{*typed->Nearest()};
  return UnitsOf(*limits, pixel);
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
  if (text.stack && apply) {
    return Refuse(Exit::Usage, "--apply is for one plan; leave --stack out, or take the stack: lensctl stack -o DIR");
  }
  if (apply && text.sharp.empty() && text.blurred.empty() && text.objective != "depth") {
    return Refuse(
        Exit::Usage,
        "--apply moves the lens to a plan, and this plan has no limit: say what has to be sharp, as in --sharp "
        "1m..2m:2px, or what has to be blurred, with --blurred");
  }
  if (auto good = CheckPlanPlots(text); !good) return PassOn(good);
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  const auto info = FindInfoOnceOpened(*link, lens);
  if (!info) return PassOn(info);
  if (auto lensless = NothingToPlan(*info)) return PassOn(*std::move(lensless));
  auto request = TypedRequest(text, session.globals().from);
  if (!request) return RefuseInput(request);
  const Json name = (*info)["name"];
  Json parameters{{"lens", name},
                  {"request", *std::move(request)},
                  {"apply", apply},
                  {"showRequest", text.plot.wanted() || text.rays.wanted()}};
  const auto reply = apply ? Drive(session, *link, MethodOfLens("Plan"), std::move(parameters))
                           : link->Ask(MethodOfLens("Plan"), std::move(parameters));
  if (!reply) return std::unexpected(InWordsOfOptions(reply.error()));
  if (auto drawn = DrawReply(text, *reply, name.get<std::string>()); !drawn) return PassOn(drawn);
  Print(session, *reply, TypedUnits(text, *info));
  return StatusOf(*reply);
}

}  // namespace lensd::cli
