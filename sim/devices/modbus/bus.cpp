// The far end of a Modbus line, RTU on a pseudo-terminal or TCP: frames in, the drives' answers out, and the faults of
// real lines.
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

/// A line that has been silent for so long begins a new frame. Real time would be 1.75 ms; a busy machine may keep a
/// writer from its second half for longer.
constexpr Duration kFrameBreak = milliseconds(10);

std::unexpected<Error> FromErrno(const std::string& what) {
  return Fail(Code::Io, what + ": " + std::strerror(errno));
}

}  // namespace

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
  faults_.late = late;
}

void ModbusBus::Inject(WireFault fault, int unit) {
  const std::lock_guard lock(mutex_);
  faults_.injected.emplace_back(fault, unit);
}

void ModbusBus::SetRandomFaults(std::map<WireFault, double> probabilities, std::uint64_t seed) {
  const std::lock_guard lock(mutex_);
  faults_.probabilities = std::move(probabilities);
  faults_.random.seed(seed);
}

void ModbusBus::Record(bool on) {
  const std::lock_guard lock(mutex_);
  seen_.recording = on;
  if (on) seen_.frames.clear();
}

std::vector<WireFrame> ModbusBus::Recorded() const {
  const std::lock_guard lock(mutex_);
  return seen_.frames;
}

int ModbusBus::GapViolations(Duration gap) const {
  const std::lock_guard lock(mutex_);
  return static_cast<int>(std::ranges::count_if(seen_.gaps, [&](Duration seen) { return seen < gap; }));
}

Duration ModbusBus::ShortestGap() const {
  const std::lock_guard lock(mutex_);
  return seen_.gaps.empty() ? Duration::max() : std::ranges::min(seen_.gaps);
}

long ModbusBus::requests() const {
  const std::lock_guard lock(mutex_);
  return seen_.requests;
}

long ModbusBus::faults() const {
  const std::lock_guard lock(mutex_);
  return faults_.count;
}

// ---- the wire -----------------------------------------------------------------------------------------------------

Result<void> ModbusBus::ServeRtu(const std::string& link) {
  Unplug();
  const std::lock_guard lock(mutex_);
  std::array<char, 256> name{};
  if (openpty(&line_.terminal, &line_.other_end, name.data(), nullptr, nullptr) != 0)
    return FromErrno("a pseudo-terminal");
  termios line{};
  tcgetattr(line_.other_end, &line);
  cfmakeraw(&line);
  tcsetattr(line_.other_end, TCSANOW, &line);
  for (const int end : {line_.terminal, line_.other_end}) fcntl(end, F_SETFD, FD_CLOEXEC);
  fcntl(line_.terminal, F_SETFL, O_NONBLOCK);
  unlink(link.c_str());
  if (symlink(name.data(), link.c_str()) != 0) return FromErrno(link);
  line_.serial = true;
  line_.link = link;
  received_[line_.terminal] = {};
  seen_.last_byte = Now() - std::chrono::seconds(1);
  Start();
  return {};
}

Result<int> ModbusBus::ServeTcp(int port) {
  Unplug();
  const std::lock_guard lock(mutex_);
  line_.listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const int yes = 1;
  setsockopt(line_.listener, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  socklen_t size = sizeof address;
  auto* const generic = reinterpret_cast<sockaddr*>(&address);
  if (bind(line_.listener, generic, size) != 0 || listen(line_.listener, 8) != 0 ||
      getsockname(line_.listener, generic, &size) != 0) {
    auto failed = FromErrno("port " + std::to_string(port));
    CloseAll();
    return failed;
  }
  line_.serial = false;
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
    if (connection == line_.terminal) continue;
    const linger reset{1, 0};  // a pulled plug says no goodbye
    setsockopt(connection, SOL_SOCKET, SO_LINGER, &reset, sizeof reset);
    close(connection);
  }
  for (int* const end : {&line_.listener, &line_.terminal, &line_.other_end}) {
    if (*end >= 0) close(*end);
    *end = -1;
  }
  // The terminal's number may soon be another program's.
  if (!line_.link.empty()) unlink(line_.link.c_str());
  line_.link.clear();
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
      if (line_.listener >= 0) watched.push_back({line_.listener, POLLIN, 0});
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
      } else if (one.fd == line_.listener) {
        Accept();
      } else {
        Receive(one.fd);
      }
    }
    SendDue();
  }
}

void ModbusBus::Accept() {
  const int connection = accept4(line_.listener, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
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
    if (connection == line_.terminal || (count < 0 && errno == EAGAIN)) return;
    close(connection);
    received_.erase(connection);
    std::erase_if(pending_,
                  [&](const Pending& one) { return one.connection == connection; });  // its number comes again
    return;
  }
  if (line_.serial && !buffer.empty() && received_at_ - seen_.last_byte > kFrameBreak) buffer.clear();
  if (line_.serial && buffer.empty()) seen_.gaps.push_back(received_at_ - seen_.last_byte);
  buffer.insert(buffer.end(), bytes.begin(), bytes.begin() + count);
  seen_.last_byte = received_at_;
  if (line_.serial) {
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
    const std::size_t length = 6u + wire::Word(buffer, 4);
    if (wire::Word(buffer, 2) != 0 || length > 260) return buffer.clear();
    if (buffer.size() < length) return;
    const Bytes frame(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(length));
    buffer.erase(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(length));
    HandleTcp(connection, frame);
  }
}

// ---- questions and answers ----------------------------------------------------------------------------------------

void ModbusBus::HandleRtu(int connection, const Bytes& frame) {
  if (seen_.recording) seen_.frames.push_back({received_at_, true, frame});
  const int unit = frame[0];
  if (!drives_.contains(unit) || drives_.at(unit)->DarkAt(Now())) return;
  if (wire::Checksum(frame) != 0) {
    const auto code = drives_.at(unit)->OnBadChecksum();
    if (code) Send(Now(), connection, wire::Rtu({frame[0], static_cast<std::uint8_t>(frame[1] | 0x80), *code}));
    return;
  }
  ++seen_.requests;
  const WireFault fault = faults_.Next(unit);
  if (fault == WireFault::Deaf) return;
  const Bytes request(frame.begin() + 1, frame.end() - 2);
  Bytes answer = fault == WireFault::Exception ? Bytes{static_cast<std::uint8_t>(frame[1] | 0x80), 4}
                                               : Answer(unit, request, fault == WireFault::Ignore);
  answer.insert(answer.begin(), frame[0]);
  Spoil(connection, unit, wire::Rtu(std::move(answer)), fault);
}

void ModbusBus::HandleTcp(int connection, const Bytes& frame) {
  if (seen_.recording) seen_.frames.push_back({received_at_, true, frame});
  const int unit = frame[6];
  if (!drives_.contains(unit) || drives_.at(unit)->DarkAt(Now())) return;
  ++seen_.requests;
  const WireFault fault = faults_.Next(unit);
  if (fault == WireFault::Deaf) return;
  const Bytes request(frame.begin() + 7, frame.end());
  const Bytes answer = fault == WireFault::Exception ? Bytes{static_cast<std::uint8_t>(frame[7] | 0x80), 4}
                                                     : Answer(unit, request, fault == WireFault::Ignore);
  Bytes reply(frame.begin(), frame.begin() + 4);
  wire::Append(reply, static_cast<std::uint16_t>(answer.size() + 1));
  reply.push_back(frame[6]);
  reply.insert(reply.end(), answer.begin(), answer.end());
  Spoil(connection, unit, std::move(reply), fault);
}

/// The function and data of the reply to those of a request.
ModbusBus::Bytes ModbusBus::Answer(int unit, const Bytes& request, bool ignore) {
  ModbusDrive& drive = *drives_.at(unit);
  const auto refuse = [&](std::uint8_t code) { return Bytes{static_cast<std::uint8_t>(request[0] | 0x80), code}; };
  if (request.size() < 5) return refuse(0x03);
  const std::uint16_t address = wire::Word(request, 1), second = wire::Word(request, 3);
  if (ignore && request[0] != 0x03) drive.Ignore(1);
  std::expected<void, std::uint8_t> written;
  if (request[0] == 0x03) {
    if (second < 1 || second > 125) return refuse(0x03);
    const auto registers = drive.Read(address, second, Now());
    if (!registers) return refuse(registers.error());
    Bytes answer = {request[0], static_cast<std::uint8_t>(2 * registers->size())};
    for (const std::uint16_t value : *registers) wire::Append(answer, value);
    return answer;
  }
  if (request[0] == 0x06) {
    written = drive.Write(address, std::array{second}, Now());
  } else if (request[0] == 0x10) {
    if (second < 1 || second > 123 || request.size() != 6u + 2u * second || request[5] != 2 * second)
      return refuse(0x03);
    std::vector<std::uint16_t> values;
    for (std::size_t i = 6; i < request.size(); i += 2) values.push_back(wire::Word(request, i));
    written = drive.Write(address, values, Now());
  } else {
    return refuse(0x01);
  }
  if (ignore) drive.Ignore(0);
  if (!written) return refuse(written.error());
  return Bytes(request.begin(), request.begin() + 5);
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
      due += faults_.late;
      free_at = due;
      break;
    case WireFault::BadCrc:
      frame[line_.serial ? frame.size() - 3 : 1] ^= 0x10;
      break;
    case WireFault::WrongUnit:
      frame[line_.serial ? 0 : 1] ^= 0x20;
      if (line_.serial) {
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
    const ssize_t sent = line_.serial
                             ? write(pending.connection, pending.bytes.data(), pending.bytes.size())
                             : send(pending.connection, pending.bytes.data(), pending.bytes.size(), MSG_NOSIGNAL);
    if (sent < 0) continue;
    seen_.last_byte = at;
    if (seen_.recording) seen_.frames.push_back({at, false, pending.bytes});
  }
}

}  // namespace lensd::sim
