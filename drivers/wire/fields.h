// The members of an object that came over the wire: each read by what it must be, the first mistake kept.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"
#include "varlink/json.h"

namespace lensd::drivers::wire {

/// Reads one object. A member that is null is absent. Wrong and missing members read as 0, false or empty until
/// Finish() says what was wrong. One thread; the object must outlive it.
class Fields {
 public:
  /// `what` names the object in messages: "axes[0]".
  Fields(const varlink::Json& object, std::string what);

  bool Has(std::string_view key) const { return Find(key) != nullptr; }
  double Number(std::string_view key, double lowest, double highest);
  /// `fallback` where it is absent.
  double NumberOr(std::string_view key, double fallback, double lowest, double highest);
  std::optional<double> MaybeNumber(std::string_view key, double lowest, double highest);
  std::int64_t Integer(std::string_view key, std::int64_t lowest, std::int64_t highest);
  std::int64_t IntegerOr(std::string_view key, std::int64_t fallback, std::int64_t lowest, std::int64_t highest);
  bool Flag(std::string_view key);
  bool FlagOr(std::string_view key, bool fallback);
  /// At most kLongestText bytes are kept.
  std::string Text(std::string_view key);
  std::string TextOr(std::string_view key, std::string fallback);
  /// The index of one of `words`.
  std::size_t Word(std::string_view key, const std::vector<std::string_view>& words);
  std::optional<std::size_t> MaybeWord(std::string_view key, const std::vector<std::string_view>& words);
  /// An object, or nullptr where it is absent.
  const varlink::Json* Object(std::string_view key);
  /// The elements of an array of at most kMostElements; none where it is absent.
  const varlink::Json::array_t& Elements(std::string_view key);

  void Reject(std::string_view key, std::string_view why);
  void Take(const Result<void>& of_a_member);
  /// Protocol: "WHAT.KEY: why".
  Result<void> Finish() const;

  static constexpr std::size_t kLongestText = 1000;
  static constexpr std::size_t kMostElements = 1000;

 private:
  const varlink::Json* Find(std::string_view key) const;
  const varlink::Json* Require(std::string_view key);

  const varlink::Json& object_;
  const std::string what_;
  std::optional<Error> error_;
};

inline constexpr double kAnyNumber = std::numeric_limits<double>::max();

}  // namespace lensd::drivers::wire
