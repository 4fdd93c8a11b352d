// One connection of lensd to a driver process, and what all connections share.
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "base/clock.h"
#include "drivers/api/device.h"
#include "drivers/wire/channel.h"
#include "hosted_device.h"
#include "varlink/interface_definition.h"

namespace lensd::drivers::host {

/// The devices that are open, by the names that lensd gives them. Any thread.
class OpenDevices {
 public:
  OpenDevices(const Driver& driver, const Clock& clock) : driver_(driver), clock_(clock) {}

  /// Busy: one of this name is open. Errors of the driver.
  Result<void> Open(const std::string& name, const Settings& settings);
  /// Null: none of this name.
  std::shared_ptr<HostedDevice> Find(const std::string& name);
  /// Interrupts its calls, stops what moves and closes it. When this returns it is closed, whoever began.
  void Close(const std::string& name);
  void CloseAll();
  /// Ends calls that are under way.
  void Interrupt(const std::vector<std::string>& names);
  const Driver& driver() const { return driver_; }

 private:
  const Driver& driver_;
  const Clock& clock_;
  std::mutex mutex_;  // guards devices_
  std::map<std::string, std::shared_ptr<HostedDevice>> devices_;
};

/// Serves the calls of one connection, in order.
class Session {
 public:
  Session(daemon::Descriptor socket, OpenDevices& devices, const varlink::InterfaceDefinition& definition);

  /// On a thread of its own: until the other side closes or breaks the rules. Closes the devices that it opened. What a
  /// driver throws comes out, after it was printed with the call under way.
  void Run();
  /// From any thread: the other side is gone. What it has under way ends soon.
  void OtherSideIsGone();
  int descriptor() const { return channel_.descriptor(); }

 private:
  /// The reply with its NUL; empty: none is due. Protocol: the connection must be closed.
  Result<std::string> Answer(std::string_view message);
  Result<wire::Json> Carry(std::string_view method, const wire::Json& parameters);
  Result<wire::Json> Open(const wire::Json& parameters);
  Result<wire::Json> Search();
  std::string Failure(std::string_view method, const wire::Json& parameters, const Error& why);

  wire::Channel channel_;
  OpenDevices& devices_;
  const varlink::InterfaceDefinition& definition_;
  std::mutex mutex_;                // guards the next
  std::vector<std::string> owned_;  ///< devices that this connection opened
};

}  // namespace lensd::drivers::host
