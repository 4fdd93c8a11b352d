// focus, aperture, home, stop.
#include <CLI/CLI.hpp>
#include <array>
#include <memory>

#include "cli/online/arguments.h"
#include "cli/online/commands.h"
#include "cli/online/link.h"
#include "cli/online/target.h"
#include "cli/online/texts.h"
#include "cli/quantity.h"

namespace lensd::cli {
namespace {

using proto::Json;

constexpr std::array<std::string_view, 4> kAxes = {"focus", "iris", "zoom", "filter"};
constexpr std::array<const char*, 3> kOrigins = {"lens", "sensor", "front"};

/// Moves one axis and prints the result. Control-C stops the axis.
Outcome Move(Session& session, Json lens, const char* axis, Json target) {
  auto link = Link::Open(session);
  if (!link) return std::unexpected(link.error());
  Json parameters{{"lens", lens}, {"axis", axis}, {"target", std::move(target)}};
  if (const auto& from = session.globals().from) {
    parameters["distanceFrom"] = kOrigins.at(static_cast<std::size_t>(*from));
  }
  auto reply = link->Follow(
      MethodOfLens("Move"), std::move(parameters), [](const Json&) { return true; },
      [&] { StopNow(session, lens, axis); });
  if (!reply) return std::unexpected(reply.error());
  const Json& move = (*reply)["move"];
  session.json() ? session.PrintJson(move) : session.PrintText(MoveText(move));
  return move.value("reached", false) ? Exit::Done : Exit::No;
}

Outcome Focus(Session& session, const std::vector<std::string>& words) {
  const NameAndValue given = SplitNameAndValue(words);
  auto target = ParseFocusTarget(given.value);
  if (!target) return Refuse(target);
  return Move(session, given.lens, "focus", *std::move(target));
}

Outcome Aperture(Session& session, const std::vector<std::string>& words) {
  const NameAndValue given = SplitNameAndValue(words);
  auto f_number = ParseFNumber(given.value, "N");
  if (!f_number) return Refuse(f_number);
  return Move(session, given.lens, "iris", {{"fNumber", *f_number->Nearest()}});
}

bool IsAxis(const std::string& word) {
  return std::ranges::find(kAxes, word) != kAxes.end();
}

Outcome Home(Session& session, const std::vector<std::string>& words) {
  // One word alone is an axis or a lens: a lens is never named like an axis.
  const bool only_lens = words.size() == 1 && !IsAxis(words[0]);
  const NameAndValue given = only_lens ? NameAndValue{words[0], ""} : SplitNameAndValue(words);
  if (!given.value.empty() && !IsAxis(given.value)) {
    return Refuse(Exit::Usage, "AXIS '" + given.value + "': say focus, iris, zoom or filter");
  }
  auto link = Link::Open(session);
  if (!link) return std::unexpected(link.error());
  const Json axis = LensOf(given.value);
  auto reply = link->Follow(
      MethodOfLens("Home"), {{"lens", given.lens}, {"axis", axis}}, [](const Json&) { return true; },
      [&] { StopNow(session, given.lens, axis); });
  if (!reply) return std::unexpected(reply.error());
  const Json& moves = (*reply)["moves"];
  if (session.json()) session.PrintJson(axis.is_null() ? moves : moves[0]);
  bool all_reached = true;
  for (const Json& move : moves) {
    if (!session.json()) session.PrintText(MoveText(move));
    all_reached &= move.value("reached", false);
  }
  return all_reached ? Exit::Done : Exit::No;
}

Outcome Stop(Session& session, const std::string& name) {
  auto link = Link::Open(session);
  if (!link) return std::unexpected(link.error());
  auto reply = link->Ask(MethodOfLens("Stop"), {{"lens", LensOf(name)}});
  if (!reply) return std::unexpected(reply.error());
  session.json() ? session.PrintJson({{"stopped", true}}) : session.PrintText("stopped");
  return Exit::Done;
}

/// A command whose words are `[NAME] VALUE`.
void AddWords(CLI::App& root, Run& run, const char* name, const char* about, const char* words_about, int least,
              Outcome (*act)(Session&, const std::vector<std::string>&)) {
  auto words = std::make_shared<std::vector<std::string>>();
  auto* command = root.add_subcommand(name, about)->group(kOnline);
  command->add_option("words", *words, words_about)->expected(least, 2)->required(least > 0)->type_name("");
  command->callback([&run, words, act] { run = [words, act](Session& session) { return act(session, *words); }; });
}

}  // namespace

void AddFocus(CLI::App& root, Run& run) {
  AddWords(root, run, "focus", "move focus and report where it stands",
           "[NAME] TARGET: a distance or vergence (0.8m, 1.2D, inf), +N or -N steps, near:N or far:N steps, @N a "
           "position, ext:2.6mm an extension",
           1, Focus);
}

void AddAperture(CLI::App& root, Run& run) {
  AddWords(root, run, "aperture", "move the iris and report where it stands", "[NAME] N: an f-number, 2.8 or f/2.8", 1,
           Aperture);
}

void AddHome(CLI::App& root, Run& run) {
  AddWords(root, run, "home", "search for the reference of an axis, or of all that have one", "[NAME] [AXIS]", 0, Home);
}

void AddStop(CLI::App& root, Run& run) {
  auto name = std::make_shared<std::string>();
  auto* command = root.add_subcommand("stop", "stop everything a lens does, whoever started it")->group(kOnline);
  command->add_option("NAME", *name, "lens");
  command->callback([&run, name] { run = [name](Session& session) { return Stop(session, *name); }; });
}

}  // namespace lensd::cli
