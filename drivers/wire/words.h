// The words of io.lensd.Driver for enumerations, each list in the order of its enumeration.
#pragma once

#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"
#include "drivers/api/lens.h"

namespace lensd::drivers::wire {

inline const std::vector<std::string_view>& AxisWords() {
  static const std::vector<std::string_view> words = {"focus", "iris", "zoom", "filter"};
  return words;
}
inline const std::vector<std::string_view>& UnitWords() {
  static const std::vector<std::string_view> words = {"steps", "dioptres", "fNumber", "millimetres", "position"};
  return words;
}
inline const std::vector<std::string_view>& FeedbackWords() {
  static const std::vector<std::string_view> words = {"none", "echo", "counts", "encoder"};
  return words;
}
inline const std::vector<std::string_view>& DirectionWords() {
  static const std::vector<std::string_view> words = {"nearPositive", "nearNegative"};
  return words;
}
inline const std::vector<std::string_view>& GainUnitWords() {
  static const std::vector<std::string_view> words = {"decibels", "native"};
  return words;
}

/// "internal" for codes that no driver has.
std::string_view CodeWord(Code code);
Code CodeFromWord(std::string_view word);

template <class Enumeration>
std::string_view WordOf(const std::vector<std::string_view>& words, Enumeration value) {
  return words[static_cast<std::size_t>(value)];
}

}  // namespace lensd::drivers::wire
