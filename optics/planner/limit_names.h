// Whether every limit of a request has a name of its own.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <functional>
#include <string_view>
#include <vector>

#include "optics/plan_request.h"

namespace lensd::optics {

/// The names of the limits so far. Each that is longer than the one before, or as long and later in the alphabet, is
/// new; from the first one on that is not, all are found by their hash, in a table that is never more than half full.
class LimitNames {
 public:
  explicit LimitNames(const std::vector<BlurLimit>& limits) : limits_(limits) {}
  /// Takes the name of the limit at `index`; false if it was taken already. In rising order of index.
  bool Take(std::size_t index) {
    const std::string_view name = limits_[index].name;
    if (std::ranges::find(kReserved, name) != kReserved.end()) return false;
    const bool rises = slots_.empty() && (index == 0 || Before(limits_[index - 1].name, name));
    return rises || TakeByHash(index);
  }

 private:
  static bool Before(std::string_view a, std::string_view b) {
    constexpr std::size_t kWord = sizeof(std::uint64_t);
    if (a.size() != b.size()) return a.size() < b.size();
    if (a.size() < kWord || a.size() > 2 * kWord) return a < b;
    const auto word = [](const char* from) {
      std::uint64_t letters = 0;
      std::memcpy(&letters, from, kWord);
      return std::byteswap(letters);
    };
    const std::uint64_t first = word(a.data()), other_first = word(b.data());
    return first != other_first ? first < other_first : word(a.end() - kWord) < word(b.end() - kWord);
  }
  [[gnu::noinline]] bool TakeByHash(std::size_t index) {
    if (slots_.empty()) {
      slots_.resize(2 * std::bit_ceil(limits_.size()));
      for (std::size_t before = 0; before < index; ++before) Insert(before);
    }
    return Insert(index);
  }
  bool Insert(std::size_t index) {
    const std::string_view name = limits_[index].name;
    const std::size_t hash = std::hash<std::string_view>()(name), mask = slots_.size() - 1;
    const auto part = static_cast<std::uint32_t>(hash >> 32U);
    std::size_t at = hash & mask;
    for (; slots_[at].taken_by != 0; at = (at + 1) & mask) {
      if (slots_[at].hash == part && limits_[slots_[at].taken_by - 1].name == name) return false;
    }
    slots_[at] = {part, static_cast<std::uint32_t>(index + 1)};
    return true;
  }

  static constexpr std::array<std::string_view, 3> kReserved{"focus", "fNumber", "extension"};
  struct Slot {
    std::uint32_t hash = 0;
    std::uint32_t taken_by = 0;  ///< a limit's index and one more; 0: by none
  };

  const std::vector<BlurLimit>& limits_;
  std::vector<Slot> slots_;
};

}  // namespace lensd::optics
