// Whose turn it is on a bus. A unit that is not there costs a whole response timeout whenever it is asked, so such
// units are asked rarely and never two in a row while others need the bus.
#pragma once

#include <map>
#include <optional>
#include <span>

#include "base/clock.h"

namespace lensd::drivers::modbus {

struct BusSlot;

/// Not for several threads at once. Units are remembered also while no lens holds them.
class Turns {
 public:
  explicit Turns(Duration response_timeout) : response_timeout_(response_timeout) {}

  using Seats = std::span<BusSlot* const>;
  /// One that a caller asks for; none: not now.
  BusSlot* Next(Seats seats, Instant now) const;
  void Served(const BusSlot& seat) { last_ = &seat; }
  /// When one that is not there, and that a caller asks for, may be asked.
  std::optional<Instant> NextAbsent(Seats seats) const;
  /// It never answered, or not for the last five times.
  bool Absent(const BusSlot& seat) const;
  /// It was asked in vain, and is not there.
  bool Missed(const BusSlot& seat) const;

  /// What became of an exchange.
  void Answered(const BusSlot& seat);
  void Failed(const BusSlot& seat, Instant now);

  struct Unit {
    bool heard = false;  ///< it has answered once
    int failures = 0;    ///< exchanges in a row
    Instant asked_at{};  ///< when it last failed to answer
  };
  Unit Of(const BusSlot& seat) const;

 private:
  Instant MayBeAsked(const BusSlot& seat, Seats seats) const;

  const Duration response_timeout_;
  std::map<int, Unit> units_;
  const BusSlot* last_ = nullptr;  ///< served; perhaps gone since
  Instant absent_asked_at_{};      ///< any of them
};

}  // namespace lensd::drivers::modbus
