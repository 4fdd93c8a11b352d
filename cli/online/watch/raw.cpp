// call, introspect: any Varlink service, since Debian 12 has no varlinkctl.
#include <CLI/CLI.hpp>
#include <memory>

#include "cli/link/daemon_client.h"
#include "cli/online/commands.h"
#include "proto/interfaces.h"

namespace lensd::cli {
namespace {

using varlink::Json;

struct CallOptions {
  std::string method;
  std::string parameters;
  bool more = false;
};

/// A short name is a method of io.lensd.Lens.
std::string FullName(const std::string& method) {
  return method.find('.') == method.npos ? MethodOfLens(method) : method;
}

Outcome Call(Session& session, const CallOptions& options) {
  Result<Json> parameters = options.parameters.empty() ? Json::object() : varlink::ParseJson(options.parameters);
  if (!parameters || !parameters->is_object()) {
    return Refuse(Exit::Usage, "JSON: the parameters must be one JSON object, such as '{\"lens\": \"a\"}'");
  }
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  const std::string method = FullName(options.method);
  const auto print = [&](const Json& reply) {
    session.PrintJson(reply);
    return true;
  };
  auto reply =
      options.more ? link->Follow(method, *std::move(parameters), print) : link->Ask(method, *std::move(parameters));
  if (!reply) return PassOn(reply);
  print(*reply);
  return Exit::Done;
}

Outcome Introspect(Session& session, const std::string& interface) {
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  if (interface.empty()) {
    auto info = link->Ask("org.varlink.service.GetInfo", Json::object());
    if (!info) return PassOn(info);
    if (session.json()) {
      session.PrintJson(*info);
      return Exit::Done;
    }
    session.PrintText("# " + info->value("product", "") + " " + info->value("version", "") + " serves");
    for (const Json& name : (*info)["interfaces"]) session.PrintText("#   " + name.get<std::string>());
  }
  const std::string wanted = interface.empty() ? std::string(proto::kLensInterface) : interface;
  auto reply = link->Ask("org.varlink.service.GetInterfaceDescription", {{"interface", wanted}});
  if (!reply) return PassOn(reply);
  session.json() ? session.PrintJson(*reply) : session.PrintText(reply->value("description", ""));
  return Exit::Done;
}

}  // namespace

void AddCall(CLI::App& root, Run& run) {
  auto options = std::make_shared<CallOptions>();
  auto* command = root.add_subcommand("call", "call any method and print its replies as JSON")->group(kPlumbing);
  command->add_option("METHOD", options->method, "interface.Method, or a method of io.lensd.Lens")->required();
  command->add_option("JSON", options->parameters, "the parameters, one JSON object");
  command->add_flag("--more", options->more, "ask for several replies");
  command->callback([&run, options] { run = [options](Session& session) { return Call(session, *options); }; });
}

void AddIntrospect(CLI::App& root, Run& run) {
  auto interface = std::make_shared<std::string>();
  auto* command =
      root.add_subcommand("introspect", "print the interface definition that the daemon serves")->group(kPlumbing);
  command->add_option("INTERFACE", *interface, "default io.lensd.Lens");
  command->callback(
      [&run, interface] { run = [interface](Session& session) { return Introspect(session, *interface); }; });
}

}  // namespace lensd::cli
