// refocus show, forget: what lensd does by itself to keep a lens in focus.
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

struct RefocusOptions {
  std::string lens;
  int result = 0;
};

std::string DriftText(const Json& state) {
  const Json& drift = state["drift"];
  if (!drift.is_object()) return TextOf(state, "driftReason");
  return "one position gains " + NumberText(drift, "umPerC", 3, " um a degree (") +
         NumberText(drift, "lowUmPerC", 3, " to ") + NumberText(drift, "highUmPerC", 3, " at 95 %), from ") +
         NumberText(drift, "results", 4, " results at ") + NumberText(drift, "coldestC", 4, " to ") +
         NumberText(drift, "hottestC", 4, " C");
}

std::string ResultText(const Json& result, std::size_t number) {
  std::string text = "  " + std::to_string(number) + "  subject " + NumberText(result, "subject", 6, ": ") +
                     NumberText(result, "temperatureC", 4, " C, extension ") +
                     NumberText(result, "extensionUm", 6, " um, sigma ") +
                     NumberText(result, "sigmaUm", 3, ", off by ") + NumberText(result, "offUm", 3, " um, ");
  if (result.value("outlier", false)) text += "OUTLIER: left out, ";
  return text + TextOf(result, "made");
}

Outcome ShowRefocus(Session& session, const RefocusOptions& options) {
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  auto reply = link->Ask(MethodOfLens("GetRefocus"), {{"lens", LensOf(options.lens)}});
  if (!reply) return PassOn(reply);
  const Json& state = (*reply)["refocus"];
  if (session.json()) {
    session.PrintJson(state);
    return Exit::Done;
  }
  const std::string reason = TextOf(state, "reason");
  session.PrintText(TextOf(state, "lens") + ": " +
                    (state.value("active", false) ? "lensd keeps the focus" : "lensd does not keep the focus") +
                    (reason.empty() ? "" : "; " + reason));
  if (state["last"].is_object()) session.PrintText(RefocusText(state["last"]));
  session.PrintText(DriftText(state));
  std::size_t number = 0;
  for (const Json& result : state["results"]) session.PrintText(ResultText(result, ++number));
  return Exit::Done;
}

Outcome ForgetResults(Session& session, const RefocusOptions& options) {
  Json parameters{{"lens", LensOf(options.lens)}};
  if (options.result > 0) parameters["result"] = options.result;
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  auto reply = link->Ask(MethodOfLens("ForgetDrift"), parameters);
  if (!reply) return PassOn(reply);
  session.json() ? session.PrintJson({{"removed", true}})
                 : session.PrintText(options.result > 0 ? "forgot result " + std::to_string(options.result)
                                                        : "forgot the learned temperature results");
  return Exit::Done;
}

}  // namespace

void AddRefocus(CLI::App& root, Run& run) {
  auto* command =
      root.add_subcommand("refocus", "show how lensd keeps a lens in focus, and what it has learned for that")
          ->group(kOnline);
  command->require_subcommand(1)->fallthrough();
  auto options = std::make_shared<RefocusOptions>();
  const auto verb = [&](const char* name, const char* about, Outcome (*act)(Session&, const RefocusOptions&)) {
    auto* added = command->add_subcommand(name, about)->fallthrough();
    added->add_option("NAME", options->lens, "lens");
    added->callback(
        [&run, options, act] { run = [options, act](Session& session) { return act(session, *options); }; });
    return added;
  };
  verb("show", "show whether lensd keeps the focus, what it did last, and what it has learned", ShowRefocus);
  auto* forget = verb("forget", "forget what was learned of focus and temperature, or one result", ForgetResults);
  forget->add_option("--result", options->result, "number of the result, from 1")->check(CLI::Range(1, 200));
}

}  // namespace lensd::cli
