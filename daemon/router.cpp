#include "router.h"

#include <cstdio>
#include <cstdlib>
#include <utility>

#include "proto/interfaces.h"

namespace lensd::daemon {

using proto::Json;

proto::InterfaceDefinition BuiltInDefinition(std::string_view text) {
  auto parsed = proto::InterfaceDefinition::Parse(text);
  if (!parsed) {
    std::fprintf(stderr, "built-in interface: %s\n", parsed.error().message.c_str());
    std::abort();
  }
  return *std::move(parsed);
}

Router::Router(ServiceInfo info) : info_(std::move(info)), own_(BuiltInDefinition(proto::ServiceInterfaceText())) {}

void Router::Add(Service& service) {
  services_.emplace(service.definition().name(), &service);
}

const proto::InterfaceDefinition* Router::FindDefinition(std::string_view interface) const {
  if (interface == own_.name()) return &own_;
  const auto found = services_.find(interface);
  return found == services_.end() ? nullptr : &found->second->definition();
}

void Router::Dispatch(const ExchangePointer& exchange) const {
  const std::string_view full = exchange->call().method;
  const std::size_t dot = full.rfind('.');
  const std::string_view interface = full.substr(0, dot == full.npos ? 0 : dot);
  const std::string_view method = full.substr(dot + 1);  // npos + 1 is 0
  const proto::InterfaceDefinition* definition = FindDefinition(interface);
  if (definition == nullptr) return exchange->Refuse(proto::kInterfaceNotFound, {{"interface", interface}});
  const auto found = definition->methods().find(method);
  if (found == definition->methods().end()) return exchange->Refuse(proto::kMethodNotFound, {{"method", method}});
  // No method leaves the protocol; answering as if nothing had been asked would say that the upgrade succeeded.
  if (exchange->call().upgrade) return exchange->Refuse(proto::kMethodNotImplemented, {{"method", method}});
  if (auto wrong = definition->FirstWrong(*found->second.input, exchange->view())) {
    return exchange->Refuse(proto::kInvalidParameter, {{"parameter", *wrong}});
  }
  if (definition == &own_) return ServeOwn(method, exchange);
  services_.find(interface)->second->Serve(method, exchange);
}

void Router::ServeOwn(std::string_view method, const ExchangePointer& exchange) const {
  if (method == "GetInfo") {
    Json interfaces{own_.name()};
    for (const auto& [name, unused] : services_) interfaces.push_back(name);
    return exchange->Finish(proto::WriteJson({{"vendor", info_.vendor},
                                              {"product", info_.product},
                                              {"version", info_.version},
                                              {"url", info_.url},
                                              {"interfaces", std::move(interfaces)}}));
  }
  const auto interface = exchange->parameters()["interface"].get<std::string>();
  const proto::InterfaceDefinition* definition = FindDefinition(interface);
  if (definition == nullptr) return exchange->Refuse(proto::kInterfaceNotFound, {{"interface", interface}});
  exchange->Finish(proto::WriteJson({{"description", definition->text()}}));
}

}  // namespace lensd::daemon
