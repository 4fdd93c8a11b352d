// learned show, forget: what autofocus has taught lensd of a lens.
#include <CLI/CLI.hpp>
#include <memory>

#include "cli/link/arguments.h"
#include "cli/link/daemon_client.h"
#include "cli/online/commands.h"
#include "cli/text/text.h"
#include "cli/text/texts.h"

namespace lensd::cli {
namespace {

using varlink::Json;

struct LearnedOptions {
  std::string lens;
};

std::string LearnedRunText(const Json& run, std::size_t number) {
  std::string text = "  " + std::to_string(number) + "  " +
                     NumberText(run, "shown", 4, " times the configured blur, ") +
                     NumberText(run, "blurPxPerUnit", 4, " px a unit at ") + NumberText(run, "position", 8, "");
  if (run["irisPosition"].is_number()) text += ", iris at " + NumberText(run, "irisPosition", 6, "");
  if (run["zoomPosition"].is_number()) text += ", zoom at " + NumberText(run, "zoomPosition", 6, "");
  if (run["aboveOverBelow"].is_number()) {
    text += ", " + NumberText(run, "aboveOverBelow", 3, " times as much above focus as below");
  }
  if (run.value("framesFromOutside", false)) text += ", frames from outside";
  if (!run.value("holds", false)) text += ", does not apply in the present state of the lens";
  return text + ", " + TextOf(run, "made");
}

Outcome ShowLearned(Session& session, const LearnedOptions& options) {
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  auto reply = link->Ask(MethodOfLens("GetLearned"), {{"lens", LensOf(options.lens)}});
  if (!reply) return PassOn(reply);
  const Json& state = (*reply)["learned"];
  if (session.json()) {
    session.PrintJson(state);
    return Exit::Done;
  }
  std::string line = TextOf(state, "lens") + ": ";
  if (const Json& known = state["known"]; known.is_object()) {
    line += "a step of focus makes " + NumberText(known, "factor", 4, " times the configured blur (") +
            NumberText(known, "low", 4, " to ") + NumberText(known, "high", 4, " at 95 %), from ") +
            NumberText(known, "runs", 4, " runs");
    if (known["uneven"].is_number()) {
      line += ", the same on both sides of focus within a factor of " + NumberText(known, "uneven", 3, "");
    }
  } else {
    line += "the configured blur is used";
  }
  const std::string reason = TextOf(state, "reason");
  session.PrintText(line + (reason.empty() ? "" : "; " + reason));
  const std::string lags = LagsText(state);
  if (!lags.empty()) session.PrintText(lags.substr(1));
  std::size_t number = 0;
  for (const Json& run : state["runs"]) session.PrintText(LearnedRunText(run, ++number));
  return Exit::Done;
}

Outcome ForgetLearned(Session& session, const LearnedOptions& options) {
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  auto reply = link->Ask(MethodOfLens("ForgetLearned"), {{"lens", LensOf(options.lens)}});
  if (!reply) return PassOn(reply);
  session.json() ? session.PrintJson({{"removed", true}}) : session.PrintText("forgot its learned blur");
  return Exit::Done;
}

}  // namespace

void AddLearned(CLI::App& root, Run& run) {
  auto* command = root.add_subcommand("learned", "what lensd has learned of a lens from autofocus")->group(kOnline);
  command->require_subcommand(1)->fallthrough();
  auto options = std::make_shared<LearnedOptions>();
  const auto verb = [&](const char* name, const char* about, Outcome (*act)(Session&, const LearnedOptions&)) {
    auto* added = command->add_subcommand(name, about)->fallthrough();
    added->add_option("NAME", options->lens, "lens");
    added->callback(
        [&run, options, act] { run = [options, act](Session& session) { return act(session, *options); }; });
  };
  verb("show", "show how fast blur grows with focus, as measured by autofocus", ShowLearned);
  verb("forget", "forget it; the next runs use the configured f-number and learn again", ForgetLearned);
}

}  // namespace lensd::cli
