#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <pty.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "sim/devices/modbus_bus.h"
#include "wire.h"

namespace lensd::sim {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr std::array<std::pair<std::string_view, WireFault>, 11> kNames = {{{"none", WireFault::None},
                                                                            {"no-reply", WireFault::NoReply},
                                                                            {"deaf", WireFault::Deaf},
                                                                            {"late", WireFault::Late},
                                                                            {"bad-crc", WireFault::BadCrc},
                                                                            {"short", WireFault::Short},
                                                                            {"wrong-unit", WireFault::WrongUnit},
                                                                            {"exception", WireFault::Exception},
                                                                            {"split", WireFault::Split},
                                                                            {"noise", WireFault::Noise},
                                                                            {"ignore", WireFault::Ignore}}};

/// A line that has been silent for so long begins a new frame. Real time would be 1.75 ms; a busy machine may keep a
/// writer from its second half for longer.
constexpr Duration kFrameBreak = milliseconds(10);

std::unexpected<Error> FromErrno(const std::string& what) {
  return Fail(Code::Io, what + ": " + std::strerror(errno));
}

std::uint16_t Word(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  return static_cast<std::uint16_t>(bytes[at] << 8 | bytes[at + 1]);
}

void Append(std::vector<std::uint8_t>& bytes, std::uint16_t word) {
  bytes.push_back(static_cast<std::uint8_t>(word >> 8));
  bytes.push_back(static_cast<std::uint8_t>(word & 0xFF));
}

}  // namespace

std::optional<WireFault> WireFaultFromName(std::string_view name) {
  const auto found = std::ranges::find(kNames, name, &std::pair<std::string_view, WireFault>::first);
  if (found == kNames.end()) return std::nullopt;
  return found->second;
}

ModbusBus::ModbusBus() {
  if (pipe2(wake_, O_CLOEXEC | O_NONBLOCK) != 0) wake_[0] = wake_[1] = -1;
}

ModbusBus::~ModbusBus() {
  Unplug();
  close(wake_[0]);
  close(wake_[1]);
}

void ModbusBus::AddDrive(int unit, std::unique_ptr<ModbusDrive> drive) {
  const std::lock_guard lock(mutex_);
  drives_[unit] = std::move(drive);
}

void ModbusBus::SetLate(Duration late) {
  const std::lock_guard lock(mutex_);
  late_ = late;
}

void ModbusBus::Inject(WireFault fault, int unit) {
  const std::lock_guard lock(mutex_);
  injected_.emplace_back(fault, unit);
}

void ModbusBus::SetRandomFaults(std::map<WireFault, double> probabilities, std::uint64_t seed) {
  const std::lock_guard lock(mutex_);
  probabilities_ = std::move(probabilities);
  random_.seed(seed);
}

void ModbusBus::Record(bool on) {
  const std::lock_guard lock(mutex_);
  recording_ = on;
  if (on) recorded_.clear();
}

std::vector<WireFrame> ModbusBus::Recorded() const {
  const std::lock_guard lock(mutex_);
  return recorded_;
}

int ModbusBus::GapViolations(Duration gap) const {
  const std::lock_guard lock(mutex_);
  return static_cast<int>(std::ranges::count_if(gaps_, [&](Duration seen) { return seen < gap; }));
}

Duration ModbusBus::ShortestGap() const {
  const std::lock_guard lock(mutex_);
  return gaps_.empty() ? Duration::max() : std::ranges::min(gaps_);
}

long ModbusBus::requests() const {
  const std::lock_guard lock(mutex_);
  return requests_;
}

long ModbusBus::faults() const {
  const std::lock_guard lock(mutex_);
  return faults_;
}

// ---- the wire -----------------------------------------------------------------------------------------------------

Result<void> ModbusBus::ServeRtu(const std::string& link) {
  Unplug();
  const std::lock_guard lock(mutex_);
  std::array<char, 256> name{};
  if (openpty(&terminal_, &other_end_, name.data(), nullptr, nullptr) != 0) return FromErrno("a pseudo-terminal");
  termios line{};
  tcgetattr(other_end_, &line);
  cfmakeraw(&line);
  tcsetattr(other_end_, TCSANOW, &line);
  for (const int end : {terminal_, other_end_}) fcntl(end, F_SETFD, FD_CLOEXEC);
  fcntl(terminal_, F_SETFL, O_NONBLOCK);
  unlink(link.c_str());
  if (symlink(name.data(), link.c_str()) != 0) return FromErrno(link);
  serial_ = true;
  link_ = link;
  received_[terminal_] = {};
  last_byte_ = Now() - std::chrono::seconds(1);
  Start();
  return {};
}

Result<int> ModbusBus::ServeTcp(int port) {
  Unplug();
  const std::lock_guard lock(mutex_);
  listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const int yes = 1;
  setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  socklen_t size = sizeof address;
  auto* const generic = reinterpret_cast<sockaddr*>(&address);
  if (bind(listener_, generic, size) != 0 || listen(listener_, 8) != 0 || getsockname(listener_, generic, &size) != 0) {
    auto failed = FromErrno("port " + std::to_string(port));
    CloseAll();
    return failed;
  }
  serial_ = false;
  Start();
  return int{ntohs(address.sin_port)};
}

void ModbusBus::Start() {
  thread_ = std::jthread([this](const std::stop_token& stop) { Serve(stop); });
}

void ModbusBus::Unplug() {
  if (thread_.joinable()) {
    thread_.request_stop();
    (void)!write(wake_[1], "x", 1);
    thread_.join();
  }
  const std::lock_guard lock(mutex_);
  CloseAll();
}

void ModbusBus::CloseAll() {
  for (const auto& [connection, unused] : received_) {
    if (connection == terminal_) continue;
    const linger reset{1, 0};  // a pulled plug says no goodbye
    setsockopt(connection, SOL_SOCKET, SO_LINGER, &reset, sizeof reset);
    close(connection);
  }
  for (int* const end : {&listener_, &terminal_, &other_end_}) {
    if (*end >= 0) close(*end);
    *end = -1;
  }
  // The terminal's number may soon be somebody else's.
  if (!link_.empty()) unlink(link_.c_str());
  link_.clear();
  received_.clear();
  pending_.clear();
  busy_until_.clear();
}

void ModbusBus::Serve(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    std::vector<pollfd> watched = {{wake_[0], POLLIN, 0}};
    int wait_ms = 1000;
    {
      const std::lock_guard lock(mutex_);
      if (listener_ >= 0) watched.push_back({listener_, POLLIN, 0});
      for (const auto& [connection, unused] : received_) watched.push_back({connection, POLLIN, 0});
      if (!pending_.empty()) {
        const auto left = std::chrono::ceil<milliseconds>(pending_.front().due - Now()).count();
        wait_ms = static_cast<int>(std::clamp<long>(left, 0, 1000));
      }
    }
    poll(watched.data(), watched.size(), wait_ms);
    const std::lock_guard lock(mutex_);
    received_at_ = Now();
    for (const pollfd& one : watched) {
      if (one.revents == 0) continue;
      if (one.fd == wake_[0]) {
        char drained[16];
        (void)!read(wake_[0], drained, sizeof drained);
      } else if (one.fd == listener_) {
        Accept();
      } else {
        Receive(one.fd);
      }
    }
    SendDue();
  }
}

void ModbusBus::Accept() {
  const int connection = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (connection < 0) return;
  const int yes = 1;
  setsockopt(connection, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  received_[connection] = {};
}

void ModbusBus::Receive(int connection) {
  Bytes& buffer = received_[connection];
  std::array<std::uint8_t, 4096> bytes{};
  const ssize_t count = read(connection, bytes.data(), bytes.size());
  if (count <= 0) {
    if (connection == terminal_ || (count < 0 && errno == EAGAIN)) return;
    close(connection);
    received_.erase(connection);
    std::erase_if(pending_,
                  [&](const Pending& one) { return one.connection == connection; });  // its number comes again
    return;
  }
  if (serial_ && !buffer.empty() && received_at_ - last_byte_ > kFrameBreak) buffer.clear();
  if (serial_ && buffer.empty()) gaps_.push_back(received_at_ - last_byte_);
  buffer.insert(buffer.end(), bytes.begin(), bytes.begin() + count);
  last_byte_ = received_at_;
  if (serial_) {
    TakeRtu(connection, buffer);
  } else {
    TakeTcp(connection, buffer);
  }
}

void ModbusBus::TakeRtu(int connection, Bytes& buffer) {
  while (!buffer.empty()) {
    const int length = wire::RequestLength(buffer);
    if (length < 0) return buffer.clear();
    if (length == 0 || static_cast<int>(buffer.size()) < length) return;
    const Bytes frame(buffer.begin(), buffer.begin() + length);
    buffer.erase(buffer.begin(), buffer.begin() + length);
    HandleRtu(connection, frame);
  }
}

void ModbusBus::TakeTcp(int connection, Bytes& buffer) {
  while (buffer.size() >= 8) {
    const std::size_t length = 6u + Word(buffer, 4);
    if (Word(buffer, 2) != 0 || length > 260) return buffer.clear();
    if (buffer.size() < length) return;
    const Bytes frame(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(length));
    buffer.erase(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(length));
    HandleTcp(connection, frame);
  }
}

// ---- questions and answers ----------------------------------------------------------------------------------------

void ModbusBus::HandleRtu(int connection, const Bytes& frame) {
  if (recording_) recorded_.push_back({received_at_, true, frame});
  const int unit = frame[0];
  if (!drives_.contains(unit)) return;
  if (wire::Checksum(frame) != 0) {
    const auto code = drives_.at(unit)->OnBadChecksum();
    if (code) Send(Now(), connection, wire::Rtu({frame[0], static_cast<std::uint8_t>(frame[1] | 0x80), *code}));
    return;
  }
  ++requests_;
  const WireFault fault = NextFault(unit);
  if (fault == WireFault::Deaf) return;
  const Bytes request(frame.begin() + 1, frame.end() - 2);
  Bytes answer = fault == WireFault::Exception ? Bytes{static_cast<std::uint8_t>(frame[1] | 0x80), 4}
                                               : Answer(unit, request, fault == WireFault::Ignore);
  answer.insert(answer.begin(), frame[0]);
  Spoil(connection, unit, wire::Rtu(std::move(answer)), fault);
}

void ModbusBus::HandleTcp(int connection, const Bytes& frame) {
  if (recording_) recorded_.push_back({received_at_, true, frame});
  const int unit = frame[6];
  if (!drives_.contains(unit)) return;
  ++requests_;
  const WireFault fault = NextFault(unit);
  if (fault == WireFault::Deaf) return;
  const Bytes request(frame.begin() + 7, frame.end());
  const Bytes answer = fault == WireFault::Exception ? Bytes{static_cast<std::uint8_t>(frame[7] | 0x80), 4}
                                                     : Answer(unit, request, fault == WireFault::Ignore);
  Bytes reply(frame.begin(), frame.begin() + 4);
  Append(reply, static_cast<std::uint16_t>(answer.size() + 1));
  reply.push_back(frame[6]);
  reply.insert(reply.end(), answer.begin(), answer.end());
  Spoil(connection, unit, std::move(reply), fault);
}

/// The function and data of the reply to those of a request.
ModbusBus::Bytes ModbusBus::Answer(int unit, const Bytes& request, bool ignore) {
  ModbusDrive& drive = *drives_.at(unit);
  const auto refuse = [&](std::uint8_t code) { return Bytes{static_cast<std::uint8_t>(request[0] | 0x80), code}; };
  if (request.size() < 5) return refuse(0x03);
  const std::uint16_t address = Word(request, 1), second = Word(request, 3);
  if (ignore && request[0] != 0x03) drive.Ignore(1);
  std::expected<void, std::uint8_t> written;
  if (request[0] == 0x03) {
    if (second < 1 || second > 125) return refuse(0x03);
    const auto registers = drive.Read(address, second, Now());
    if (!registers) return refuse(registers.error());
    Bytes answer = {request[0], static_cast<std::uint8_t>(2 * registers->size())};
    for (const std::uint16_t value : *registers) Append(answer, value);
    return answer;
  }
  if (request[0] == 0x06) {
    written = drive.Write(address, std::array{second}, Now());
  } else if (request[0] == 0x10) {
    if (second < 1 || second > 123 || request.size() != 6u + 2u * second || request[5] != 2 * second)
      return refuse(0x03);
    std::vector<std::uint16_t> values;
    for (std::size_t i = 6; i < request.size(); i += 2) values.push_back(Word(request, i));
    written = drive.Write(address, values, Now());
  } else {
    return refuse(0x01);
  }
  if (ignore) drive.Ignore(0);
  if (!written) return refuse(written.error());
  return Bytes(request.begin(), request.begin() + 5);
}

WireFault ModbusBus::NextFault(int unit) {
  const auto waiting =
      std::ranges::find_if(injected_, [&](const auto& one) { return one.second == 0 || one.second == unit; });
  WireFault fault = WireFault::None;
  if (waiting != injected_.end()) {
    fault = waiting->first;
    injected_.erase(waiting);
  } else if (!probabilities_.empty()) {
    double draw = std::uniform_real_distribution<double>(0.0, 1.0)(random_);
    for (const auto& [kind, probability] : probabilities_) {
      if (draw < probability) {
        fault = kind;
        break;
      }
      draw -= probability;
    }
  }
  if (fault != WireFault::None) ++faults_;
  return fault;
}

/// Sends an answer as the fault has it.
void ModbusBus::Spoil(int connection, int unit, Bytes frame, WireFault fault) {
  Duration& free_at = busy_until_[unit];
  Duration due = std::max(Now(), free_at);
  const auto half = static_cast<std::ptrdiff_t>(frame.size() / 2);
  switch (fault) {
    case WireFault::NoReply:
      return;
    case WireFault::Late:
      due += late_;
      free_at = due;
      break;
    case WireFault::BadCrc:
      frame[serial_ ? frame.size() - 3 : 1] ^= 0x10;
      break;
    case WireFault::WrongUnit:
      frame[serial_ ? 0 : 1] ^= 0x20;
      if (serial_) {
        frame.resize(frame.size() - 2);
        frame = wire::Rtu(std::move(frame));
      }
      break;
    case WireFault::Short:
      frame.resize(static_cast<std::size_t>(half));
      break;
    case WireFault::Split:
      Send(due, connection, Bytes(frame.begin(), frame.begin() + half));
      frame.erase(frame.begin(), frame.begin() + half);
      due += milliseconds(2);
      break;
    case WireFault::Noise:
      frame.insert(frame.begin(), {0xFF, 0x5A, 0x00});
      break;
    case WireFault::None:
    case WireFault::Deaf:
    case WireFault::Exception:
    case WireFault::Ignore:
      break;
  }
  Send(due, connection, std::move(frame));
}

void ModbusBus::Send(Duration due, int connection, Bytes bytes) {
  const auto place = std::ranges::upper_bound(pending_, due, {}, &Pending::due);
  pending_.insert(place, Pending{due, connection, std::move(bytes)});
}

void ModbusBus::SendDue() {
  while (!pending_.empty() && pending_.front().due <= Now()) {
    const Pending pending = std::move(pending_.front());
    pending_.pop_front();
    if (!received_.contains(pending.connection)) continue;
    const Duration at = Now();
    const ssize_t sent = serial_ ? write(pending.connection, pending.bytes.data(), pending.bytes.size())
                                 : send(pending.connection, pending.bytes.data(), pending.bytes.size(), MSG_NOSIGNAL);
    if (sent < 0) continue;
    last_byte_ = at;
    if (recording_) recorded_.push_back({at, false, pending.bytes});
  }
}

}  // namespace lensd::sim
