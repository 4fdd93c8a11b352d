// From a method's full name to the service that serves it, with the checks every call must pass on the way.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"
#include "daemon/server/access.h"
#include "daemon/server/exchange.h"
#include "daemon/server/method_table.h"
#include "varlink/interface_definition.h"

namespace lensd::daemon {

/// One interface and who serves its methods.
class Service {
 public:
  virtual ~Service() = default;
  virtual const varlink::InterfaceDefinition& definition() const = 0;
  /// A row for each method of the definition; the same for good.
  virtual const MethodTable& methods() const = 0;
  /// Whether it is there now: else its interface is not served, as if it had never been added.
  virtual bool Offered() const { return true; }
  /// Whether the caller may call it now. False: it has been told why not.
  virtual bool Admit(const Method& /*method*/, const ExchangePointer& /*exchange*/) { return true; }
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
  /// Everybody may do everything until Restrict().
  explicit Router(const ServiceInfo& info);
  /// From now on a method is served to those clients only that have its role.
  void Restrict(Access access) { access_ = std::move(access); }
  Role RoleOf(const Credentials& client) const { return access_ ? access_->RoleOf(client) : Role::Administer; }
  /// `service` must outlive the router. A method without a row is our own bug and ends the program.
  void Add(Service& service);
  /// Whether a message is a call, not a long one, of a method that acts when it is read. Quick, and it may err: it says
  /// yes to a message that merely names one.
  bool ActsWhenRead(std::string_view message) const;
  /// Finds the service, checks the parameters, and passes the call on or refuses it.
  void Dispatch(const ExchangePointer& exchange) const;

 private:
  const varlink::InterfaceDefinition* FindDefinition(std::string_view interface) const;
  bool Allows(const Method& method, const ExchangePointer& exchange) const;
  void ServeOwn(std::string_view method, const ExchangePointer& exchange) const;

  varlink::InterfaceDefinition own_;
  std::string info_;  // GetInfo's answer, an object, without the interfaces
  std::optional<Access> access_;
  std::vector<std::string> act_when_read_;  // full names
  struct Served {
    Service* service = nullptr;
    std::map<std::string_view, const Method*> methods;
  };
  std::map<std::string, Served, std::less<>> services_;
};

/// Parses a definition that is part of the program: failure is our own bug and ends it.
varlink::InterfaceDefinition BuiltInDefinition(std::string_view text);

}  // namespace lensd::daemon
