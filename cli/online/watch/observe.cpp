// list, status, monitor, metrics.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "cli/link/arguments.h"
#include "cli/link/daemon_client.h"
#include "cli/online/commands.h"
#include "cli/online/watch/watch_screen.h"
#include "cli/text/event_text.h"
#include "cli/text/texts.h"

namespace lensd::cli {
namespace {

using varlink::Json;

Outcome List(Session& session) {
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  auto reply = link->Ask(MethodOfLens("List"), Json::object());
  if (!reply) return PassOn(reply);
  const Json& lenses = (*reply)["lenses"];
  if (session.json()) {
    session.PrintJson(lenses);
    return Exit::Done;
  }
  for (const Json& lens : lenses) session.PrintText(InfoText(lens));
  if (lenses.empty()) session.PrintText("no lens is configured");
  return Exit::Done;
}

Outcome StatusOnce(Session& session, DaemonClient& link, const std::string& name) {
  auto reply = link.Ask(MethodOfLens("Status"), {{"lens", LensOf(name)}});
  if (!reply) return PassOn(reply);
  const Json& lenses = (*reply)["lenses"];
  if (session.json()) {
    session.PrintJson(lenses.size() == 1 ? lenses[0] : lenses);
    return Exit::Done;
  }
  for (const Json& lens : lenses) session.PrintText(StatusText(lens));
  if (lenses.empty()) session.PrintText("no lens is configured");
  return Exit::Done;
}

/// A stream that --timeout, a person or a closing daemon ends.
Outcome Follow(DaemonClient& link, const char* method, const std::string& name, const DaemonClient::Progress& show) {
  auto ended = link.Follow(MethodOfLens(method), {{"lens", LensOf(name)}}, show);
  if (!ended && ended.error().status == Exit::Timeout) return Exit::Done;  // --timeout says how long to look on
  if (!ended) return PassOn(ended);
  return Exit::Done;
}

Outcome Status(Session& session, const std::string& name, bool watch) {
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  if (!watch) return StatusOnce(session, *link, name);
  if (!session.json() && isatty(STDIN_FILENO) == 1 && isatty(STDOUT_FILENO) == 1) return WatchScreen(session, name);
  return Follow(*link, "Status", name, [&](const Json& reply) {
    for (const Json& lens : reply["lenses"]) {
      session.json() ? session.PrintJson(lens) : session.PrintText(StatusText(lens));
    }
    return true;
  });
}

Outcome Monitor(Session& session, const std::string& name) {
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  return Follow(*link, "Monitor", name, [&](const Json& reply) {
    const Json& event = reply["event"];
    session.json() ? session.PrintJson(event) : session.PrintText(EventText(event));
    return true;
  });
}

Outcome Metrics(Session& session, const std::string& name) {
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  auto reply = link->Ask(MethodOfLens("Metrics"), {{"lens", LensOf(name)}});
  if (!reply) return PassOn(reply);
  const Json& lenses = (*reply)["lenses"];
  if (session.json()) {
    session.PrintJson(lenses.size() == 1 ? lenses[0] : lenses);
    return Exit::Done;
  }
  for (const Json& lens : lenses) session.PrintText(MetricsText(lens));
  if (lenses.empty()) session.PrintText("no lens is configured");
  return Exit::Done;
}

}  // namespace

void AddList(CLI::App& root, Run& run) {
  auto* command = root.add_subcommand("list", "the configured lenses and what they can do")->group(kOnline);
  command->callback([&run] { run = List; });
}

void AddStatus(CLI::App& root, Run& run) {
  struct Options {
    std::string name;
    bool watch = false;
  };
  auto options = std::make_shared<Options>();
  auto* command = root.add_subcommand("status", "show where a lens stands and what it does; all lenses without NAME");
  command->group(kOnline);
  command->add_option("NAME", options->name, "lens");
  command->add_flag("--watch", options->watch,
                    "until Control-C, show a live screen with keys for focus steps, autofocus and stop; if the output "
                    "is no terminal, one line at each change");
  command->callback([&run, options] {
    run = [options](Session& session) { return Status(session, options->name, options->watch); };
  });
}

void AddMetrics(CLI::App& root, Run& run) {
  auto name = std::make_shared<std::string>();
  auto* command = root.add_subcommand("metrics", "count what lenses did and what went wrong since lensd started");
  command->group(kOnline);
  command->add_option("NAME", *name, "lens; all of them when left out");
  command->callback([&run, name] { run = [name](Session& session) { return Metrics(session, *name); }; });
}

void AddMonitor(CLI::App& root, Run& run) {
  auto name = std::make_shared<std::string>();
  auto* command =
      root.add_subcommand("monitor",
                          "print one line for each event until Control-C: states, progress, finished moves, autofocus "
                          "runs and backlash measurements, faults, leases, changes of calibration and presets, lenses "
                          "that come and go. States and progress are skipped if newer ones exist. With --json one "
                          "object a line, with `sequence` and `lasting` as counters of the events");
  command->group(kOnline);
  command->add_option("NAME", *name, "lens; all of them when left out");
  command->callback([&run, name] { run = [name](Session& session) { return Monitor(session, *name); }; });
}

}  // namespace lensd::cli
