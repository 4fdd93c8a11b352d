// What went wrong between a device and us.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>

#include "base/clock.h"
#include "base/result.h"

namespace lensd::drivers {

/// Since the device was opened. None ever falls.
struct Counters {
  std::uint64_t frames = 0;          ///< that came whole
  std::uint64_t frames_lost = 0;     ///< damaged, incomplete, or missing between two that came
  std::uint64_t frames_late = 0;     ///< came a frame time or more after they were due by the one before
  std::uint64_t packets_lost = 0;    ///< of a network; those that came when asked for again are not among them
  std::uint64_t packets_resent = 0;  ///< of a network, that came when asked for again
  std::uint64_t frames_damaged = 0;  ///< of the lost ones: those that came and could not be used
  std::uint64_t frames_flawed = 0;   ///< that came with bytes too many or without an end marker, and show all the same
  std::uint64_t bus_errors = 0;      ///< questions not answered, or answered against the rules, repeated ones included

  bool operator==(const Counters&) const = default;
};

/// An error of the connection, other than that no device is there.
inline bool IsBusError(Code code) {
  return code == Code::Timeout || code == Code::Protocol || code == Code::Io;
}

/// Counts the frames of one camera. Any thread.
class FrameCounter {
 public:
  /// 0: not known, or frames come when they are asked for: none is late.
  explicit FrameCounter(double rate_hz);

  /// A stream begins: what was before is no gap.
  void Restart();
  /// A whole frame, with its number among all that were exposed, and when it came or was exposed, always the same.
  void Came(std::uint64_t sequence, Instant at);
  /// A frame that came and cannot be used; its number and time as in Came(), which may have counted the same frame.
  void Damaged(std::uint64_t sequence, Instant at);
  /// A frame that Came() has counted is whole, and still has bytes that it should not have, or lacks its end marker.
  void Flawed();
  void CountPackets(std::uint64_t lost, std::uint64_t resent);
  Counters counts() const;

 private:
  struct Arrival {
    std::uint64_t sequence;
    Instant at;
  };
  const double rate_hz_;
  mutable std::mutex mutex_;  // guards everything below
  std::optional<Arrival> last_;
  Counters counts_;
};

}  // namespace lensd::drivers
