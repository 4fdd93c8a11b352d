// stack: plan the shots, move to each, save what the camera sees, and merge it where that is asked for.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "cli/link/daemon_client.h"
#include "cli/link/drive.h"
#include "cli/link/lens_info.h"
#include "cli/online/commands.h"
#include "cli/online/pictures/pictures.h"
#include "cli/online/plan/plan.h"
#include "cli/online/plan/plan_request.h"
#include "cli/plan/stack_answer.h"
#include "cli/plan/stack_plot.h"
#include "cli/text/texts.h"

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

/// Takes the shots of `plan` and notes in it what came of each. What was taken before it failed stays in the folder.
std::expected<std::vector<std::string>, Failure> TakeShots(Session& session, DaemonClient& link, const Json& lens,
                                                           Json& plan, const std::string& folder) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) return Refuse(Exit::CannotWrite, folder + ": " + failed.message());
  std::vector<std::string> files;
  for (Json& shot : plan["shots"]) {
    const std::string path = folder + "/shot-" + std::to_string(files.size() + 1) + ".png";
    const auto frame = Shoot(session, link, lens, shot, path);
    if (!frame) {
      session.Remark(std::to_string(files.size()) + " of " + std::to_string(plan["shots"].size()) + " shots are in " +
                     folder + (files.size() > 1 ? "; lensctl merge can merge them" : ""));
      return PassOn(frame);
    }
    shot["frame"] = *frame;
    files.push_back(path);
    session.Remark(path);
  }
  return files;
}

bool Wanted(const MergeText& merge) {
  return !merge.picture.empty() || !merge.depth.empty();
}

}  // namespace

Outcome RunStackOnline(PlanText text, const MergeText& merge, const std::string& lens, const std::string& folder,
                       Session& session) {
  text.stack = true;
  if (auto good = CheckPlot(text.plot); !good) return PassOn(good);
  if (auto good = CheckMerge(merge); !good) return PassOn(good);
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  const auto info = FindInfoOnceOpened(*link, lens);
  if (!info) return PassOn(info);
  if (auto lensless = NothingToPlan(*info)) return PassOn(*std::move(lensless));
  auto request = TypedRequest(text, session.globals().from);
  if (!request) return RefuseInput(request);
  const Json name = (*info)["name"];
  const auto reply = link->Ask(MethodOfLens("Plan"), {{"lens", name}, {"request", *std::move(request)}});
  if (!reply) return std::unexpected(InWordsOfOptions(reply.error()));
  Json plan = (*reply)["plan"];
  if (!plan.value("feasible", false)) {
    session.json() ? session.PrintJson(plan) : session.PrintText(StackText(plan));
    return Exit::No;
  }
  if (auto drawn = WritePlot(text.plot, io::ChartSvg(StackChart(plan, name.get<std::string>()))); !drawn) {
    return PassOn(drawn);
  }
  const auto files = TakeShots(session, *link, name, plan, folder);
  if (!files) return PassOn(files);
  if (Wanted(merge)) {
    auto merged = MergeFiles(session, *files, merge);
    if (!merged) return PassOn(merged);
    plan["merged"] = *std::move(merged);
  }
  session.json() ? session.PrintJson(plan) : session.PrintText(StackText(plan));
  if (Wanted(merge) && !session.json()) session.PrintText(MergedText(plan["merged"]));
  return Exit::Done;
}

void AddStack(CLI::App& root, Run& run) {
  struct Options {
    PlanText text;
    MergeText merge;
    std::string lens;
    std::string folder;
  };
  auto options = std::make_shared<Options>();
  auto* command = root.add_subcommand("stack", "take the fewest pictures that together make everything sharp");
  command->group(kOnline);
  command->add_option("NAME", options->lens, "lens");
  command->add_option("-o", options->folder, "where to save the pictures")->required()->type_name("DIR");
  command->add_option("--merge", options->merge.picture, "merge the pictures into one that is sharp everywhere")
      ->type_name("FILE");
  AddMergeOptions(*command, options->merge);
  AddPlanOptions(*command, options->text);
  command->callback([&run, options] {
    run = [options](Session& session) {
      return RunStackOnline(options->text, options->merge, options->lens, options->folder, session);
    };
  });
}

}  // namespace lensd::cli
