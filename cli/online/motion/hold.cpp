// hold: corrections of the lens wait while another program exposes.
#include <CLI/CLI.hpp>
#include <chrono>
#include <memory>
#include <utility>

#include "base/clock.h"
#include "cli/link/arguments.h"
#include "cli/link/daemon_client.h"
#include "cli/online/commands.h"
#include "cli/text/quantity.h"
#include "cli/text/texts.h"

namespace lensd::cli {
namespace {

using varlink::Json;

struct HoldOptions {
  std::string name;
  std::string time;
};

/// The hold lives as long as its connection, and so as long as this command.
Outcome Hold(Session& session, const HoldOptions& options) {
  const auto time = ParseTime(options.time, "--for");
  if (!time) return PassOn(time);
  if (*time > std::chrono::hours(1)) return Refuse(Exit::Usage, "--for '" + options.time + "': an hour at most");
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  const Instant until = MonotonicClock().Now() + *time;
  const Json parameters{{"lens", LensOf(options.name)}, {"untilNs", until.time_since_epoch().count()}};
  bool told = false;
  const auto show = [&](const Json& held) {
    if (std::exchange(told, true)) return true;
    if (session.json()) {
      session.PrintJson(held);
    } else {
      session.PrintText("corrections wait" + UntilText(held["untilNs"]) +
                        (held.value("atRest", false) ? ", the lens is at rest" : ", the lens still moves"));
    }
    session.Remark("Control-C ends it");
    return true;
  };
  auto ended = link->Follow(MethodOfLens("Hold"), parameters, show);
  if (!ended) return PassOn(ended);
  return Exit::Done;
}

}  // namespace

void AddHold(CLI::App& root, Run& run) {
  auto options = std::make_shared<HoldOptions>();
  auto* command = root.add_subcommand(
      "hold",
      "keep lensd from correcting a lens while another program exposes; commands and stops are still carried out");
  command->group(kOnline);
  command->add_option("NAME", options->name, "lens");
  command->add_option("--for", options->time, "how long, such as 30s, an hour at most; Control-C ends it earlier")
      ->required()
      ->type_name("TIME");
  command->callback([&run, options] { run = [options](Session& session) { return Hold(session, *options); }; });
}

}  // namespace lensd::cli
