// Which exchange goes wrong, and how: those asked for first, then at random.
#include "sim/devices/modbus_faults.h"

#include <algorithm>
#include <array>
#include <utility>

namespace lensd::sim {
namespace {

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

}  // namespace

std::optional<WireFault> WireFaultFromName(std::string_view name) {
  const auto found = std::ranges::find(kNames, name, &std::pair<std::string_view, WireFault>::first);
  if (found == kNames.end()) return std::nullopt;
  return found->second;
}

WireFault WireFaults::Next(int unit) {
  const auto waiting =
      std::ranges::find_if(injected, [&](const auto& one) { return one.second == 0 || one.second == unit; });
  WireFault fault = WireFault::None;
  if (waiting != injected.end()) {
    fault = waiting->first;
    injected.erase(waiting);
  } else if (!probabilities.empty()) {
    double draw = std::uniform_real_distribution<double>(0.0, 1.0)(random);
    for (const auto& [kind, probability] : probabilities) {
      if (draw < probability) {
        fault = kind;
        break;
      }
      draw -= probability;
    }
  }
  if (fault != WireFault::None) ++count;
  return fault;
}

}  // namespace lensd::sim
