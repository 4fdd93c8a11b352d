// Which readings of a lens' thermometer are believed.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include "base/clock.h"
#include "base/units.h"
#include "rig/config.h"

namespace lensd::rig {

/// A sensor that came loose, was reset or is read wrongly reports numbers like any other. A reading that is outside the
/// configured range, or that the temperature cannot have reached since an earlier one that was believed, is left out;
/// what was believed before it holds on, without limit of age; after 30 s of silence `fault()` says so.
class Thermometer {
 public:
  explicit Thermometer(const TemperatureConfig& config) : config_(config) {}

  /// One reading of the lens, and when it was taken; nothing: it reported no temperature.
  void Note(std::optional<Celsius> reading, Instant at);

  /// The newest reading that was believed; nothing: there was none.
  std::optional<Celsius> believed() const { return believed_; }
  /// Why the newest reading was left out, or that none comes any more; empty: it was believed.
  const std::string& fault() const { return fault_; }
  /// How many were left out.
  std::uint64_t left_out() const { return left_out_; }

 private:
  /// A number that sensors report which measure nothing.
  struct Doubt {
    Celsius value;
    Instant since;
  };
  std::string WhyNot(Celsius reading, Instant at);
  void Believe(Celsius reading, Instant at);

  const TemperatureConfig config_;
  std::optional<Celsius> believed_;
  Instant at_{};  ///< of `believed_`; lowest_ and highest_ are as of then
  /// What every reading that was believed allows.
  double lowest_ = -std::numeric_limits<double>::infinity(), highest_ = std::numeric_limits<double>::infinity();
  bool whole_degrees_ = true;  ///< all that were believed were such
  std::optional<Doubt> doubt_;
  std::optional<Instant> silent_since_;
  std::string fault_;
  std::uint64_t left_out_ = 0;
};

}  // namespace lensd::rig
