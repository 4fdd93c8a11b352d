// Drives on a wire: a Modbus RTU line (a pseudo-terminal) or a TCP server, byte for byte, with everything that goes
// wrong on real ones.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "sim/devices/modbus_drive.h"
#include "sim/devices/modbus_faults.h"

namespace lensd::sim {

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
  struct Line {
    bool serial = false;
    int listener = -1;
    int terminal = -1;
    int other_end = -1;  ///< held open, so that closing it does not hang up
    std::string link;    ///< points to the terminal
  };
  struct Seen {
    bool recording = false;
    std::vector<WireFrame> frames;
    std::vector<Duration> gaps;
    Duration last_byte{};
    long requests = 0;
  };

  void Start();
  void Serve(const std::stop_token& stop);
  void Accept();
  void Receive(int connection);
  void TakeRtu(int connection, Bytes& buffer);
  void TakeTcp(int connection, Bytes& buffer);
  void HandleRtu(int connection, const Bytes& frame);
  void HandleTcp(int connection, const Bytes& frame);
  Bytes Answer(int unit, const Bytes& request, bool ignore);
  void Spoil(int connection, int unit, Bytes frame, WireFault fault);
  void Send(Duration due, int connection, Bytes bytes);
  void SendDue();
  void CloseAll();

  const MonotonicClock clock_;
  const Instant began_ = clock_.Now();

  mutable std::mutex mutex_;  // guards everything below
  std::map<int, std::unique_ptr<ModbusDrive>> drives_;
  Line line_;
  int wake_[2] = {-1, -1};
  std::map<int, Bytes> received_;       ///< by connection
  std::deque<Pending> pending_;         ///< by time
  std::map<int, Duration> busy_until_;  ///< by unit: drives answer in order
  Duration received_at_{};
  WireFaults faults_;
  Seen seen_;

  std::jthread thread_;
};

}  // namespace lensd::sim
