// libmodbus as one connection behind Result. Its own recovery is off: it loops and sleeps inside a send.
#include "link.h"

#include <fcntl.h>
#include <modbus.h>
#include <netdb.h>
#include <sys/select.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>

namespace lensd::drivers::modbus {
namespace {

using std::chrono::milliseconds;

// What libmodbus 3.1.6 knows; any other it would take for 9600.
constexpr std::array kBauds = {1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400, 460800, 921600};

/// "host", "host:port", "[v6]", "[v6]:port", "v6".
void SplitHost(const std::string& text, BusConfig& config) {
  const auto bracket = text.find(']');
  const bool bracketed = text.starts_with('[') && bracket != std::string::npos;
  const auto colon = text.find(':', bracketed ? bracket : 0);
  const bool has_port = colon != std::string::npos && (bracketed || text.find(':', colon + 1) == std::string::npos);
  config.host = bracketed ? text.substr(1, bracket - 1) : has_port ? text.substr(0, colon) : text;
  if (has_port) config.port = text.substr(colon + 1);
}

bool IsPort(const std::string& text) {
  return !text.empty() && text.size() <= 5 && std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; }) &&
         std::stoi(text) >= 1 && std::stoi(text) <= 65535;
}

Duration Milliseconds(double ms) {
  return std::chrono::microseconds(std::llround(ms * 1e3));
}

void SetTimeout(modbus_t* context, Duration timeout) {
  const auto us = std::chrono::duration_cast<std::chrono::microseconds>(timeout).count();
  modbus_set_response_timeout(context, static_cast<std::uint32_t>(us / 1000000),
                              static_cast<std::uint32_t>(us % 1000000));
}

bool IsLost(int error) {
  switch (error) {
    case EIO:
    case ENXIO:
    case ENODEV:
    case ENOTTY:
    case EPIPE:
    case EBADF:
    case ECONNRESET:
    case ECONNABORTED:
    case ECONNREFUSED:
    case ENOTCONN:
    case EHOSTUNREACH:
    case ENETUNREACH:
    case ENETDOWN:
      return true;
    default:
      return false;
  }
}

/// A well-formed answer that says no.
bool IsRefusal(int error) {
  return (error > MODBUS_ENOBASE && error < EMBBADCRC) || error == EMBBADEXC;
}

/// The one place where libmodbus' errno becomes an error.
Error FromErrno(int error) {
  switch (error) {
    case ETIMEDOUT:
      return {Code::Timeout, "did not answer in time"};
    case EMBXGPATH:
    case EMBXGTAR:
      return {Code::Busy, "does not answer the gateway now"};
    case EMBXSBUSY:
    case EMBXACK:
      return {Code::Busy, "says that it is busy"};
    case EMBBADCRC:
      return {Code::Protocol, "gave an answer with a wrong checksum"};
    case EMBBADSLAVE:
      return {Code::Protocol, "was asked, and another unit answered"};
    case EMBBADDATA:
    case EMBUNKEXC:
    case EMBMDATA:
      return {Code::Protocol, "gave an answer that does not fit the question"};
    case EMBBADEXC:
      return {Code::Protocol,
              "refuses with a code of its own (0x11 not readable, 0x12 not writable or 0x13 out of range "
              "on Applied Motion drives)"};
    default:
      break;
  }
  if (IsRefusal(error)) return {Code::Protocol, std::string("refuses: ") + modbus_strerror(error)};
  if (IsLost(error)) return {Code::Disconnected, std::string("cannot be reached: ") + modbus_strerror(error)};
  return {Code::Protocol, modbus_strerror(error)};
}

/// A pseudo terminal (a serial port over a network) has no parity, and the C library says so with EINVAL, but only when
/// nothing else changes: as after a lensd that was killed. This changes the speed.
bool Disturb(const std::string& device) {
  const int descriptor = open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) return false;
  termios line{};
  const bool other = tcgetattr(descriptor, &line) == 0 &&
                     cfsetspeed(&line, cfgetospeed(&line) == B1200 ? B2400 : B1200) == 0 &&
                     tcsetattr(descriptor, TCSANOW, &line) == 0;
  close(descriptor);
  return other;
}

/// Why nothing could be opened, from what libmodbus leaves behind.
std::string WhyNotOpened(const BusConfig& config, int error) {
  if (config.serial() && (error == ENOTTY || error == EINVAL)) return "this is no serial port";
  // It waits for the connection itself, and then leaves what the connecting began with.
  if (!config.serial() && error == EINPROGRESS) return "nothing there answers";
  if (!config.serial() && error == ECONNREFUSED) return "the host is there and refuses: nothing listens at this port";
  return error == 0 ? "there is no such host" : modbus_strerror(error);
}

/// A name or an address that can be turned into an address. libmodbus says of others that they refuse.
bool HasAddress(const BusConfig& config) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (getaddrinfo(config.host.c_str(), config.port.c_str(), &hints, &found) != 0) return false;
  freeaddrinfo(found);
  return true;
}

}  // namespace

std::string BusConfig::Endpoint() const {
  return serial() ? device : host + ":" + port;
}

Result<BusConfig> ReadBusConfig(const Settings& table) {
  SettingsReader read(table, "[[bus]]");
  BusConfig config;
  config.where = table.where();
  config.name = read.RequiredText("name");
  (void)read.OptionalText("driver");
  config.device = read.Text("device", "");
  if (const auto host = read.OptionalText("host")) SplitHost(*host, config);
  if (config.device.empty() == config.host.empty()) read.Reject("", "needs either device, a serial port, or host");
  if (!config.host.empty() && !IsPort(config.port)) read.Reject("host", "is HOST:PORT with a port from 1 to 65535");
  config.baud = static_cast<int>(read.Integer("baud", 115200));
  if (std::ranges::find(kBauds, config.baud) == kBauds.end()) {
    read.Reject("baud", "must be a usual rate from 1200 to 921600, not " + std::to_string(config.baud));
  }
  if (read.Any("parity") != nullptr) config.parity = "NEO"[read.Choice("parity", {"none", "even", "odd"}, 0)];
  config.stop_bits = static_cast<int>(read.Integer("stop_bits", 1, {1, 2}));
  config.response_timeout = Milliseconds(read.Number("response_timeout_ms", 100.0, {1.0, 10e3}));
  config.connect_timeout = Milliseconds(read.Number("connect_timeout_ms", 500.0, {1.0, 10e3}));
  config.gap = Milliseconds(read.Number("gap_ms", 0.0, {0.0, 100.0}));
  for (const char* key : {"baud", "parity", "stop_bits"}) {
    if (!config.serial() && read.Has(key)) read.Reject(key, "is for serial ports, and this is a host");
  }
  if (auto done = read.Finish(); !done) return PassOn(done);
  return config;
}

ModbusLink::~ModbusLink() {
  Close();
}

void ModbusLink::Close() {
  if (context_ == nullptr) return;
  modbus_close(context_);
  modbus_free(context_);
  context_ = nullptr;
}

Result<void> ModbusLink::Refuse(std::string why) {
  Close();
  return Fail(Code::Disconnected, config_.Endpoint() + ": " + std::move(why));
}

Result<void> ModbusLink::Open() {
  Close();
  if (!config_.serial() && !HasAddress(config_)) return Refuse("there is no such host");
  context_ = config_.serial() ? modbus_new_rtu(config_.device.c_str(), config_.baud, parity_, 8, config_.stop_bits)
                              : modbus_new_tcp_pi(config_.host.c_str(), config_.port.c_str());
  if (context_ == nullptr) return Refuse(modbus_strerror(errno));
  modbus_set_error_recovery(context_, MODBUS_ERROR_RECOVERY_NONE);
  SetTimeout(context_, config_.connect_timeout);
  errno = 0;
  int connected = modbus_connect(context_);
  if (connected != 0 && errno == EINVAL && config_.serial() && Disturb(config_.device)) {
    connected = modbus_connect(context_);
  }
  if (connected != 0) return Refuse(WhyNotOpened(config_, errno));
  const int descriptor = modbus_get_socket(context_);
  // libmodbus selects without looking.
  if (descriptor < 0 || descriptor >= FD_SETSIZE) return Refuse("too many files are open");
  SetTimeout(context_, config_.response_timeout);
  modbus_set_byte_timeout(context_, 0, 0);  // the whole answer within the response timeout
  termios line{};
  if (config_.serial() && tcgetattr(descriptor, &line) == 0) {
    line.c_cflag &= ~static_cast<tcflag_t>(HUPCL);  // closing the port must not reset an adapter
    tcsetattr(descriptor, TCSANOW, &line);
  }
  return {};
}

void ModbusLink::Flush() {
  if (context_ != nullptr) modbus_flush(context_);
}

Result<void> ModbusLink::Judge(int returned) {
  const int error = errno;
  outcome_ = Outcome::Answered;
  if (returned >= 0) return {};
  if (IsLost(error)) {
    Close();
    outcome_ = Outcome::Lost;
  } else if (!IsRefusal(error)) {
    outcome_ = Outcome::Bad;
  }
  return PassOn(FromErrno(error));
}

Result<void> ModbusLink::Read(int unit, int function, std::uint16_t address, std::span<std::uint16_t> registers) {
  modbus_set_slave(context_, unit);
  const int count = static_cast<int>(registers.size());
  const int returned = function == 4 ? modbus_read_input_registers(context_, address, count, registers.data())
                                     : modbus_read_registers(context_, address, count, registers.data());
  // An exception of its own is how some say that a register cannot be read.
  const bool has_none = returned < 0 && (errno == EMBXILFUN || errno == EMBXILADD || errno == EMBBADEXC);
  auto judged = Judge(returned);
  if (has_none) judged.error().code = Code::Unsupported;
  return judged;
}

Result<void> ModbusLink::Write(int unit, int function, std::uint16_t address,
                               std::span<const std::uint16_t> registers) {
  modbus_set_slave(context_, unit);
  const int count = static_cast<int>(registers.size());
  return Judge(function == 6 ? modbus_write_register(context_, address, registers[0])
                             : modbus_write_registers(context_, address, count, registers.data()));
}

}  // namespace lensd::drivers::modbus
