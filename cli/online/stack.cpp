// stack: plan the shots, move to each, save what the camera sees.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "cli/online/commands.h"
#include "cli/online/daemon_client.h"
#include "cli/online/drive.h"
#include "cli/online/lens_info.h"
#include "cli/online/pictures.h"
#include "cli/online/plan.h"
#include "cli/online/plan_request.h"
#include "cli/online/texts.h"
#include "cli/plan/stack_answer.h"
#include "cli/plan/stack_plot.h"

namespace lensd::cli {
namespace {

using varlink::Json;

/// Moves one axis; not arriving is a failure here, since the pictures would not be what was planned.
std::expected<void, Failure> MoveTo(Session& session, DaemonClient& link, const Json& lens, const char* axis,
                                    Json target) {
  const auto reply =
      Drive(session, link, MethodOfLens("Move"), {{"lens", lens}, {"axis", axis}, {"target", std::move(target)}}, axis);
  if (!reply) return PassOn(reply);
  const Json& move = (*reply)["move"];
  if (move.value("reached", false)) return {};
  return Refuse(Exit::Unavailable, std::string(axis) + " did not arrive: " + TextOf(move, "reason"));
}

/// To where the daemon planned the shot, in the lens' own units.
std::expected<Json, Failure> Shoot(Session& session, DaemonClient& link, const Json& lens, const Json& shot,
                                   const std::string& path) {
  for (const auto& [axis, place] : {std::pair("iris", "irisPosition"), std::pair("focus", "focusPosition")}) {
    const auto native = shot.find(place);
    if (native == shot.end() || native->is_null()) continue;
    const auto moved = MoveTo(session, link, lens, axis, {{"position", *native}});
    if (!moved) return PassOn(moved);
  }
  return SaveSnapshot(link, {{"lens", lens}}, path);
}

}  // namespace

Outcome RunStackOnline(PlanText text, const std::string& lens, const std::string& folder, Session& session) {
  text.stack = true;
  if (auto good = CheckPlot(text.plot); !good) return PassOn(good);
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  const auto info = FindInfo(*link, lens);
  if (!info) return PassOn(info);
  if (auto lensless = NothingToPlan(*info)) return PassOn(*std::move(lensless));
  auto request = TypedRequest(text, session.globals().from);
  if (!request) return RefuseInput(request);
  const Json name = (*info)["name"];
  const auto reply = link->Ask(MethodOfLens("Plan"), {{"lens", name}, {"request", *std::move(request)}});
  if (!reply) return PassOn(reply);
  Json plan = (*reply)["plan"];
  if (!plan.value("feasible", false)) {
    session.json() ? session.PrintJson(plan) : session.PrintText(StackText(plan));
    return Exit::No;
  }
  if (auto drawn = WritePlot(text.plot, io::ChartSvg(StackChart(plan, name.get<std::string>()))); !drawn) {
    return PassOn(drawn);
  }
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) return Refuse(Exit::CannotWrite, folder + ": " + failed.message());
  for (std::size_t i = 0; i < plan["shots"].size(); ++i) {
    const std::string path = folder + "/shot-" + std::to_string(i + 1) + ".png";
    const auto frame = Shoot(session, *link, name, plan["shots"][i], path);
    if (!frame) return PassOn(frame);
    plan["shots"][i]["frame"] = *frame;
    session.Remark(path);
  }
  session.json() ? session.PrintJson(plan) : session.PrintText(StackText(plan));
  return Exit::Done;
}

void AddStack(CLI::App& root, Run& run) {
  struct Options {
    PlanText text;
    std::string lens;
    std::string folder;
  };
  auto options = std::make_shared<Options>();
  auto* command = root.add_subcommand("stack", "take the fewest pictures that together make everything sharp");
  command->group(kOnline);
  command->add_option("NAME", options->lens, "lens");
  command->add_option("-o", options->folder, "where to save the pictures")->required()->type_name("DIR");
  AddPlanOptions(*command, options->text);
  command->callback([&run, options] {
    run = [options](Session& session) {
      return RunStackOnline(options->text, options->lens, options->folder, session);
    };
  });
}

}  // namespace lensd::cli
