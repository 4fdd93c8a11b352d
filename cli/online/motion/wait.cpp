// wait, reset: until a lens is as a script needs it, and making it so.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <memory>

#include "cli/link/arguments.h"
#include "cli/link/daemon_client.h"
#include "cli/link/lens_info.h"
#include "cli/online/commands.h"
#include "cli/text/texts.h"

namespace lensd::cli {
namespace {

using varlink::Json;

struct State {
  std::string_view name;
  bool (*holds)(const Json& lens);
};

bool Connected(const Json& lens) {
  return lens.value("connected", false);
}

bool Idle(const Json& lens) {
  const auto moving = [](const Json& axis) { return axis.value("moving", false); };
  return Connected(lens) && TextOf(lens, "activity") == "idle" && std::ranges::none_of(lens["axes"], moving);
}

bool Homed(const Json& lens) {
  return Connected(lens) &&
         std::ranges::all_of(lens["axes"], [](const Json& axis) { return axis.value("homed", false); });
}

constexpr std::array kStates = {State{"idle", Idle}, State{"connected", Connected}, State{"homed", Homed}};

Outcome Wait(Session& session, const std::vector<std::string>& words) {
  const NameAndValue given = SplitNameAndValue(words);
  const auto* const state = std::ranges::find(kStates, given.value, &State::name);
  if (state == kStates.end() && words.size() == 1 && IsLens(session, given.value)) {
    return Refuse(Exit::Usage,
                  "'" + given.value + "' is a lens, and the STATE is missing: say idle, connected or homed");
  }
  if (state == kStates.end()) {
    return Refuse(Exit::Usage, "STATE '" + given.value + "': say idle, connected or homed");
  }
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  Json seen;
  auto ended = link->Follow(MethodOfLens("Status"), {{"lens", given.lens}}, [&](const Json& reply) {
    seen = reply["lenses"];
    return !std::ranges::all_of(seen, state->holds);
  });
  if (!ended && ended.error().status == Exit::Timeout) {
    std::string still;
    for (const Json& lens : seen) still += (still.empty() ? "" : "; ") + StatusText(lens);
    return Refuse(Exit::Timeout, "not " + given.value + " in time: " + still);
  }
  if (!ended) return PassOn(ended);
  if (session.json()) {
    session.PrintJson(seen.size() == 1 ? seen[0] : seen);
  } else {
    for (const Json& lens : seen) session.PrintText(StatusText(lens));
  }
  return Exit::Done;
}

Outcome Reset(Session& session, const std::vector<std::string>& words) {
  const bool only_lens = words.size() == 1 && !IsAxis(words[0]);
  const NameAndValue given = only_lens ? NameAndValue{words[0], ""} : SplitNameAndValue(words);
  if (!given.value.empty() && !IsAxis(given.value)) return Refuse(Exit::Usage, UnknownAxis(given.value));
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  auto reset = link->Ask(MethodOfLens("ResetFaults"), {{"lens", given.lens}, {"axis", LensOf(given.value)}});
  if (!reset) return PassOn(reset);
  auto status = link->Ask(MethodOfLens("Status"), {{"lens", given.lens}});
  if (!status) return PassOn(status);
  const Json& lenses = (*status)["lenses"];
  if (session.json()) {
    session.PrintJson(lenses.size() == 1 ? lenses[0] : lenses);
    return Exit::Done;
  }
  for (const Json& lens : lenses) session.PrintText(StatusText(lens));
  return Exit::Done;
}

}  // namespace

void AddWait(CLI::App& root, Run& run) {
  auto words = std::make_shared<std::vector<std::string>>();
  auto* command =
      root.add_subcommand("wait", "wait until a lens is idle, connected or homed; without NAME until all are");
  command->group(kOnline);
  command
      ->add_option(
          "words", *words,
          "[NAME] STATE: idle (answers, and nothing moves or is measured), connected (answers) or homed (every "
          "axis knows where it stands)")
      ->expected(1, 2)
      ->required()
      ->type_name("");
  command->callback([&run, words] { run = [words](Session& session) { return Wait(session, *words); }; });
}

void AddReset(CLI::App& root, Run& run) {
  auto words = std::make_shared<std::vector<std::string>>();
  auto* command = root.add_subcommand(
      "reset",
      "end a latched stop and clear faults whose cause is gone, then show the state of the lens; nothing moves");
  command->group(kOnline);
  command->add_option("words", *words, "[NAME] [AXIS]: clear one axis only")->expected(0, 2)->type_name("");
  command->callback([&run, words] { run = [words](Session& session) { return Reset(session, *words); }; });
}

}  // namespace lensd::cli
