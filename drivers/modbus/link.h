// The connection of one bus: libmodbus behind Result, with none of its own recovery. Readings and moves are repeated by
// the rig (rig/common/retries.h), stops by bus.cpp, opening by driver.cpp.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "base/clock.h"
#include "base/result.h"
#include "base/settings.h"

struct _modbus;  // NOLINT(bugprone-reserved-identifier): libmodbus names it so

namespace lensd::drivers::modbus {

/// One [[bus]].
struct BusConfig {
  std::string name;
  Location where;
  std::string device;  ///< serial port; empty: TCP
  std::string host;
  std::string port = "502";
  int baud = 115200;
  std::optional<char> parity;  ///< 'N', 'E', 'O'; none: what the profiles say
  int stop_bits = 1;
  Duration response_timeout = std::chrono::milliseconds(100);
  Duration connect_timeout = std::chrono::milliseconds(500);
  Duration gap{};  ///< silence between frames, beyond what Modbus and the profiles ask

  /// "/dev/ttyUSB0" or "10.0.0.7:502": buses with the same endpoint are the same wire.
  std::string Endpoint() const;
  bool serial() const { return !device.empty(); }
};

/// Reads a [[bus]] table. BadData: "file:line: what is wrong".
Result<BusConfig> ReadBusConfig(const Settings& table);

/// One thread uses it. Every exchange ends within the response timeout once its request is sent.
class ModbusLink {
 public:
  /// What became of an exchange, besides its Result.
  enum class Outcome {
    Answered,  ///< with what was asked for, or with a refusal (an exception)
    Bad,       ///< no answer, a broken one or another unit's: more may be under way
    Lost,      ///< the port or the connection is gone; closed
  };

  ModbusLink(const BusConfig& config, char parity) : config_(config), parity_(parity) {}
  ~ModbusLink();
  ModbusLink(const ModbusLink&) = delete;
  ModbusLink& operator=(const ModbusLink&) = delete;

  bool open() const { return context_ != nullptr; }
  /// Disconnected; ends within the connect timeout (a serial port: at once).
  Result<void> Open();
  void Close();
  /// Forgets what has been received.
  void Flush();

  /// Function 3 or 4. Errors: Timeout, Protocol (broken answer, refusal), Unsupported (it says that it has no such
  /// registers or function), Busy (it or a gateway wants to be asked again), Disconnected; outcome() says more.
  Result<void> Read(int unit, int function, std::uint16_t address, std::span<std::uint16_t> registers);
  /// Function 6 or 16.
  Result<void> Write(int unit, int function, std::uint16_t address, std::span<const std::uint16_t> registers);
  /// Of the last Read() or Write().
  Outcome outcome() const { return outcome_; }

 private:
  Result<void> Judge(int returned);
  Result<void> Refuse(std::string why);

  const BusConfig& config_;
  const char parity_;
  _modbus* context_ = nullptr;
  Outcome outcome_ = Outcome::Answered;
};

}  // namespace lensd::drivers::modbus
