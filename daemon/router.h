// From a method's full name to the service that serves it, with the checks every call must pass on the way.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "base/result.h"
#include "exchange.h"
#include "proto/interface_definition.h"

namespace lensd::daemon {

/// One interface and who serves its methods.
class Service {
 public:
  virtual ~Service() = default;
  virtual const proto::InterfaceDefinition& definition() const = 0;
  /// Serves one call now or later. `method` exists in the definition and the parameters match it.
  virtual void Serve(std::string_view method, const ExchangePointer& exchange) = 0;
};

/// What GetInfo answers.
struct ServiceInfo {
  std::string vendor;
  std::string product;
  std::string version;
  std::string url;
};

/// Event loop thread only. Serves org.varlink.service itself.
class Router {
 public:
  explicit Router(ServiceInfo info);
  /// `service` must outlive the router.
  void Add(Service& service);
  /// Finds the service, checks the parameters, and passes the call on or refuses it.
  void Dispatch(const ExchangePointer& exchange) const;

 private:
  const proto::InterfaceDefinition* FindDefinition(std::string_view interface) const;
  void ServeOwn(std::string_view method, const ExchangePointer& exchange) const;

  ServiceInfo info_;
  proto::InterfaceDefinition own_;
  std::map<std::string, Service*, std::less<>> services_;
};

/// Parses a definition that is part of the program: failure is our own bug and ends it.
proto::InterfaceDefinition BuiltInDefinition(std::string_view text);

}  // namespace lensd::daemon
