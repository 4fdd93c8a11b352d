// stack: plan the shots, move to each, save what the camera sees.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "cli/online/commands.h"
#include "cli/online/lens_info.h"
#include "cli/online/link.h"
#include "cli/online/pictures.h"
#include "cli/online/plan.h"
#include "cli/plan/stack_answer.h"
#include "optics/stack.h"

namespace lensd::cli {
namespace {

using proto::Json;

/// Moves one axis; not arriving is a failure here, since the pictures would not be what was planned.
std::expected<void, Failure> MoveTo(Session& session, Link& link, const Json& lens, const char* axis, Json target) {
  const auto reply = link.Follow(
      MethodOfLens("Move"), {{"lens", lens}, {"axis", axis}, {"target", std::move(target)}},
      [](const Json&) { return true; }, [&] { StopNow(session, lens, axis); });
  if (!reply) return std::unexpected(reply.error());
  const Json& move = (*reply)["move"];
  if (move.value("reached", false)) return {};
  return Refuse(Exit::Unavailable, std::string(axis) + " did not arrive: " + move.value("reason", ""));
}

std::expected<Json, Failure> Shoot(Session& session, Link& link, const Json& lens, const optics::StackShot& shot,
                                   const std::string& path) {
  auto moved = MoveTo(session, link, lens, "iris", {{"fNumber", shot.f_number.value}});
  if (moved) moved = MoveTo(session, link, lens, "focus", {{"extensionMm", shot.extension.value * 1e3}});
  if (!moved) return std::unexpected(moved.error());
  return SaveSnapshot(link, lens, path);
}

}  // namespace

Outcome RunStackOnline(const PlanText& text, const std::string& lens, const std::string& folder, Session& session) {
  auto link = Link::Open(session);
  if (!link) return std::unexpected(link.error());
  const auto info = FindInfo(*link, lens);
  if (!info) return std::unexpected(info.error());
  auto question = ReadPlan(text, DefaultsOf(*info), OriginOf(session, *info));
  if (!question) return Refuse(question);
  optics::PlanRequest motors;
  AddTolerances(*info, motors);
  if (text.sensor_tolerance.empty()) question->request.sensor_tolerance = motors.sensor_tolerance;
  if (text.f_number_tolerance.empty()) question->request.f_number_tolerance = motors.f_number_tolerance;
  const auto answer = optics::PlanStack(question->request);
  if (!answer) return Refuse(answer);
  Json json = StackJson(*answer);
  if (!answer->feasible) {
    session.json() ? session.PrintJson(json) : session.PrintText(StackText(*answer));
    return Exit::No;
  }
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) return Refuse(Exit::Io, folder + ": " + failed.message());
  for (std::size_t i = 0; i < answer->shots.size(); ++i) {
    const std::string path = folder + "/shot-" + std::to_string(i + 1) + ".png";
    const auto frame = Shoot(session, *link, (*info)["name"], answer->shots[i], path);
    if (!frame) return std::unexpected(frame.error());
    json["shots"][i]["frame"] = *frame;
    session.Remark(path);
  }
  session.json() ? session.PrintJson(json) : session.PrintText(StackText(*answer));
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
