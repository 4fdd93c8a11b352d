// lease take, lease drop.
#include <CLI/CLI.hpp>
#include <memory>
#include <optional>

#include "cli/link/arguments.h"
#include "cli/link/daemon_client.h"
#include "cli/online/commands.h"
#include "cli/text/quantity.h"

namespace lensd::cli {
namespace {

using varlink::Json;

struct TakeOptions {
  std::string name;
  std::string time;
  bool take_over = false;
  bool stop = false;
};

/// Without a time the lease lives as long as this command.
Outcome Take(Session& session, const TakeOptions& options) {
  Json parameters{{"lens", LensOf(options.name)}};
  if (options.take_over) parameters["takeOver"] = true;
  if (options.stop) parameters["stop"] = true;
  if (!options.time.empty()) {
    const auto wanted = ParseTime(options.time, "--for");
    if (!wanted) return PassOn(wanted);
    parameters["forMs"] = std::chrono::duration<double, std::milli>(*wanted).count();
  }
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  const auto taken = link->Ask(MethodOfLens("TakeLease"), parameters);
  if (!taken) return PassOn(taken);
  if (session.json()) {
    session.PrintJson(*taken);
  } else {
    session.PrintText((*taken).value("lease", ""));
  }
  session.Remark("no other client can move " + (*taken).value("lens", "") +
                 " now; set LENSD_LEASE to this key to move it");
  if (!options.time.empty()) return Exit::Done;
  session.Remark("Control-C ends the lease");
  auto ended = link->Follow(MethodOfLens("Monitor"), {{"lens", (*taken)["lens"]}}, [](const Json&) { return true; });
  if (!ended && ended.error().status == Exit::Timeout) return Exit::Done;  // --timeout says how long to hold it
  if (!ended) return PassOn(ended);
  return Exit::Done;
}

Outcome Drop(Session& session, const std::string& name) {
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  const auto dropped = link->Ask(MethodOfLens("DropLease"), {{"lens", LensOf(name)}});
  if (!dropped) return PassOn(dropped);
  session.json() ? session.PrintJson({{"dropped", true}}) : session.PrintText("dropped");
  return Exit::Done;
}

}  // namespace

void AddLease(CLI::App& root, Run& run) {
  auto options = std::make_shared<TakeOptions>();
  auto* command = root.add_subcommand("lease", "keep others from moving a lens; everyone can still stop it");
  command->group(kOnline)->require_subcommand(1);
  auto* take = command->add_subcommand(
      "take",
      "take the lease, or renew the one whose key is in LENSD_LEASE, print its key, and hold it until Control-C");
  take->add_option("NAME", options->name, "lens");
  take->add_option("--for", options->time, "return at once; the lease ends after this time, such as 10min")
      ->type_name("TIME");
  take->add_flag("--take-over", options->take_over, "take the lease from its holder; for administrators");
  take->add_flag("--stop", options->stop, "end a running autofocus of another client, instead of being refused");
  take->callback([&run, options] { run = [options](Session& session) { return Take(session, *options); }; });
  auto* drop = command->add_subcommand("drop", "end the lease whose key is in LENSD_LEASE");
  drop->add_option("NAME", options->name, "lens");
  drop->callback([&run, options] { run = [options](Session& session) { return Drop(session, options->name); }; });
}

}  // namespace lensd::cli
