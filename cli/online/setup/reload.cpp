// reload: has the daemon read its configuration again.
#include <CLI/CLI.hpp>

#include "cli/link/daemon_client.h"
#include "cli/link/lens_info.h"
#include "cli/online/commands.h"

namespace lensd::cli {
namespace {

using varlink::Json;

std::string Names(const Json& names) {
  std::string text;
  for (const Json& name : names) text += (text.empty() ? "" : ", ") + name.get<std::string>();
  return text;
}

Outcome Reload(Session& session) {
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  const auto reloaded = ReloadAndOpen(*link);
  if (!reloaded) return PassOn(reloaded);
  for (const std::string& line : reloaded->absent) session.Remark(line);
  if (session.json()) {
    session.PrintJson(reloaded->reply);
    return Exit::Done;
  }
  for (const char* what : {"added", "removed", "reopened", "unchanged"}) {
    if (const Json& names = reloaded->reply.value(what, Json::array()); !names.empty())
      session.PrintText(std::string(what) + ": " + Names(names));
  }
  return Exit::Done;
}

}  // namespace

void AddReload(CLI::App& root, Run& run) {
  auto* command = root.add_subcommand("reload",
                                      "let the daemon read its configuration again, and wait until what has changed is "
                                      "open; unchanged lenses keep running");
  command->group(kOnline);
  command->callback([&run] { run = Reload; });
}

}  // namespace lensd::cli
