// From a method's name to its handler, after the checks that every call must pass. Handlers may rely on the kinds of
// their parameters.
#include "daemon/server/router.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <utility>

#include "base/guarded.h"
#include "proto/errors_and_methods.h"
#include "proto/interfaces.h"

namespace lensd::daemon {

using varlink::Json;

varlink::InterfaceDefinition BuiltInDefinition(std::string_view text) {
  auto parsed = varlink::InterfaceDefinition::Parse(text);
  if (!parsed) {
    std::fprintf(stderr, "built-in interface: %s\n", parsed.error().message.c_str());
    std::abort();
  }
  return *std::move(parsed);
}

MethodTable Described(std::string_view interface, MethodTable methods) {
  for (Method& method : methods) {
    const auto* row = std::ranges::find_if(proto::kMethods, [&](const proto::MethodRow& known) {
      return known.interface == interface && known.name == method.name;
    });
    if (row == std::end(proto::kMethods)) {
      std::fprintf(stderr, "proto/errors_and_methods.md: no row for %s\n", std::string(method.name).c_str());
      std::abort();
    }
    method.needs_lease = row->needs_lease;
    method.may_change_state = row->may_change_state;
    method.streams = row->streams;
    method.role = row->role;
  }
  return methods;
}

Router::Router(const ServiceInfo& info)
    : own_(BuiltInDefinition(varlink::ServiceInterfaceText())),
      info_(varlink::WriteJson(
          {{"vendor", info.vendor}, {"product", info.product}, {"version", info.version}, {"url", info.url}})) {}

void Router::Add(Service& service) {
  Served served{&service, {}};
  for (const Method& method : service.methods()) served.methods.emplace(method.name, &method);
  for (const auto& [name, unused] : service.definition().methods()) {
    if (served.methods.contains(name)) continue;
    std::fprintf(stderr, "built-in interface: no handler for %s\n", name.c_str());
    std::abort();
  }
  for (const Method& method : service.methods()) {
    if (method.acts == Acts::WhenRead) {
      act_when_read_.push_back(service.definition().name() + "." + std::string(method.name) + "\"");
    }
  }
  services_.emplace(service.definition().name(), std::move(served));
}

bool Router::ActsWhenRead(std::string_view message) const {
  constexpr std::size_t kLongest = 4096;
  return message.size() <= kLongest && std::ranges::any_of(act_when_read_, [&](const std::string& name) {
           return message.find(name) != message.npos;
         });
}

const varlink::InterfaceDefinition* Router::FindDefinition(std::string_view interface) const {
  if (interface == own_.name()) return &own_;
  const auto found = services_.find(interface);
  const bool there = found != services_.end() && found->second.service->Offered();
  return there ? &found->second.service->definition() : nullptr;
}

void Router::Dispatch(const ExchangePointer& exchange) const {
  const std::string_view full = exchange->call().method;
  const std::size_t dot = full.rfind('.');
  const std::string_view interface = full.substr(0, dot == full.npos ? 0 : dot);
  const std::string_view method = full.substr(dot + 1);  // npos + 1 is 0
  const varlink::InterfaceDefinition* definition = FindDefinition(interface);
  if (definition == nullptr) return exchange->Refuse(varlink::kInterfaceNotFound, {{"interface", interface}});
  const auto found = definition->methods().find(method);
  if (found == definition->methods().end()) return exchange->Refuse(varlink::kMethodNotFound, {{"method", method}});
  // No method leaves the protocol; answering as if nothing had been asked would say that the upgrade succeeded.
  if (exchange->call().upgrade) return exchange->Refuse(varlink::kMethodNotImplemented, {{"method", method}});
  if (auto wrong = definition->FirstWrong(*found->second.input, exchange->view())) {
    return exchange->Refuse(varlink::kInvalidParameter, {{"parameter", *wrong}});
  }
  if (definition == &own_) return ServeOwn(method, exchange);
  const Served& served = services_.find(interface)->second;
  const Method& row = *served.methods.at(method);
  if (exchange->call().more && row.streams == Streams::No) {
    return exchange->Refuse(varlink::kInvalidParameter, {{"parameter", "more"}});
  }
  if (!exchange->call().more && row.streams == Streams::Only) {
    return exchange->Refuse(varlink::kExpectedMore, Json::object());
  }
  if (!Allows(row, exchange)) return;
  // No client is told what it finds, and it does nothing else.
  if (exchange->call().oneway && row.may_change_state == MayChangeState::No) return exchange->Finish("{}");
  const auto thrown = Guarded(std::string(full), [&] {
    if (served.service->Admit(row, exchange)) row.serve(exchange);
  });
  if (thrown) exchange->Refuse(std::string(interface) + ".Internal", {{"message", thrown->message}});
}

/// False: the caller has been told who may.
bool Router::Allows(const Method& method, const ExchangePointer& exchange) const {
  if (!access_) return true;
  const bool only_asks = method.needs_lease == NeedsLease::ToApply && !exchange->Asks("apply");
  const bool administers = !method.administers.empty() && exchange->Asks(method.administers);
  const Role needed = administers ? Role::Administer : only_asks ? Role::Observe : method.role;
  if (RoleOf(exchange->credentials()) >= needed) return true;
  const std::vector<std::string> groups = access_->GroupsFor(needed);
  std::string names;
  for (const std::string& name : groups) names += (names.empty() ? "" : ", ") + name;
  exchange->Refuse(
      std::string(proto::kLensInterface) + ".NotPermitted",
      {{"message", std::string(method.name) + (administers ? " with " + std::string(method.administers) : "") +
                       " needs the role " + std::string(RoleName(needed)) + ", which user " +
                       std::to_string(exchange->credentials().user) + " does not have: it is given to members of " +
                       (names.empty() ? "no group" : names) +
                       " ([access] of the configuration), from their next login on"},
       {"role", RoleName(needed)},
       {"groups", groups}});
  return false;
}

void Router::ServeOwn(std::string_view method, const ExchangePointer& exchange) const {
  if (method == "GetInfo") {
    std::string answer = "{\"interfaces\":[\"" + own_.name() + "\"";  // names of interfaces need no escaping
    for (const auto& [name, served] : services_) {
      if (served.service->Offered()) answer.append(",\"").append(name).append("\"");
    }
    return exchange->Finish(answer.append("],").append(info_, 1));
  }
  const auto interface = exchange->parameters()["interface"].get<std::string>();
  const varlink::InterfaceDefinition* definition = FindDefinition(interface);
  if (definition == nullptr) return exchange->Refuse(varlink::kInterfaceNotFound, {{"interface", interface}});
  exchange->Finish(varlink::WriteJson({{"description", definition->text()}}));
}

}  // namespace lensd::daemon
