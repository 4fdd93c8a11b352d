// Drives on a wire: a Modbus RTU line (a pseudo-terminal) or a TCP server, byte for byte, with everything that goes
// wrong on real ones.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "sim/devices/modbus_drive.h"

namespace lensd::sim {

/// What becomes of one exchange.
enum class WireFault {
  None,
  NoReply,    ///< obeyed, not answered
  Deaf,       ///< neither obeyed nor answered
  Late,       ///< answered after ModbusBus::late
  BadCrc,     ///< one bit of the answer is wrong (on TCP: another transaction's number)
  Short,      ///< the answer ends after half of it
  WrongUnit,  ///< the answer names another unit (on TCP: another transaction's number)
  Exception,  ///< not obeyed; exception 4, device failure
  Split,      ///< the answer comes in two parts, 2 ms apart: legal, if barely
  Noise,      ///< obeyed; garbage comes before the answer
  Ignore,     ///< a motion is acknowledged and not begun
};
std::optional<WireFault> WireFaultFromName(std::string_view name);

/// Bytes seen on the wire.
struct WireFrame {
  Duration at{};
  bool from_client = false;
  std::vector<std::uint8_t> bytes;
};

/// All methods from any thread. One thread of its own serves the wire.
class ModbusBus {
 public:
  ModbusBus();
  ~ModbusBus();
  ModbusBus(const ModbusBus&) = delete;
  ModbusBus& operator=(const ModbusBus&) = delete;

  void AddDrive(int unit, std::unique_ptr<ModbusDrive> drive);

  /// A pseudo-terminal; `link` becomes a symbolic link to its other end, replacing another
  /// link; it goes when the wire is cut.
  Result<void> ServeRtu(const std::string& link);
  /// On 127.0.0.1; port 0: any. The port.
  Result<int> ServeTcp(int port);
  /// The wire is cut: the terminal hangs up, connections are reset. Serve...() mends it; drives keep their state.
  void Unplug();

  /// How late a late answer is.
  void SetLate(Duration late);
  /// The next exchange of `unit` (0: of any) goes wrong this way; further calls queue up.
  void Inject(WireFault fault, int unit = 0);
  /// Exchanges go wrong at random: each kind with its probability.
  void SetRandomFaults(std::map<WireFault, double> probabilities, std::uint64_t seed);
  /// Does something to a drive between exchanges.
  template <class Do>
  auto With(int unit, Do&& action) {
    const std::lock_guard lock(mutex_);
    return action(*drives_.at(unit), Now());
  }

  /// Time since it was made.
  Duration Now() const { return clock_.Now() - began_; }
  /// Keeps the frames from now on / those kept so far.
  void Record(bool on);
  std::vector<WireFrame> Recorded() const;
  /// Requests that came sooner after the last byte than `gap` (RTU).
  int GapViolations(Duration gap) const;
  /// Shortest silence before a request so far (RTU).
  Duration ShortestGap() const;
  long requests() const;
  long faults() const;

 private:
  struct Pending {
    Duration due{};
    int connection = -1;
    std::vector<std::uint8_t> bytes;
  };
  using Bytes = std::vector<std::uint8_t>;

  void Start();
  void Serve(const std::stop_token& stop);
  void Accept();
  void Receive(int connection);
  void TakeRtu(int connection, Bytes& buffer);
  void TakeTcp(int connection, Bytes& buffer);
  void HandleRtu(int connection, const Bytes& frame);
  void HandleTcp(int connection, const Bytes& frame);
  Bytes Answer(int unit, const Bytes& request, bool ignore);
  WireFault NextFault(int unit);
  void Spoil(int connection, int unit, Bytes frame, WireFault fault);
  void Send(Duration due, int connection, Bytes bytes);
  void SendDue();
  void CloseAll();

  const MonotonicClock clock_;
  const Instant began_ = clock_.Now();

  mutable std::mutex mutex_;  // guards everything below
  std::map<int, std::unique_ptr<ModbusDrive>> drives_;
  bool serial_ = false;
  int listener_ = -1;
  int terminal_ = -1;
  int other_end_ = -1;  ///< held open, so that closing it does not hang up
  std::string link_;    ///< points to the terminal
  int wake_[2] = {-1, -1};
  std::map<int, Bytes> received_;       ///< by connection
  std::deque<Pending> pending_;         ///< by time
  std::map<int, Duration> busy_until_;  ///< by unit: drives answer in order
  Duration late_ = std::chrono::milliseconds(60);
  std::deque<std::pair<WireFault, int>> injected_;
  std::map<WireFault, double> probabilities_;
  std::mt19937_64 random_;
  bool recording_ = false;
  std::vector<WireFrame> recorded_;
  std::vector<Duration> gaps_;
  Duration last_byte_{};
  Duration received_at_{};
  long requests_ = 0;
  long faults_ = 0;

  std::jthread thread_;
};

}  // namespace lensd::sim
