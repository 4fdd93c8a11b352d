// What goes wrong on a simulated Modbus wire.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <random>
#include <string_view>
#include <utility>

#include "base/clock.h"

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

/// What is to go wrong.
struct WireFaults {
  Duration late = std::chrono::milliseconds(60);   ///< how late a late answer is
  std::deque<std::pair<WireFault, int>> injected;  ///< with the unit; 0: any
  std::map<WireFault, double> probabilities;
  std::mt19937_64 random;
  long count = 0;  ///< so far

  /// Of the next exchange with `unit`.
  WireFault Next(int unit);
};

}  // namespace lensd::sim
