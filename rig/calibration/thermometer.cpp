// What a temperature can be by now follows from every reading that was believed: so far from it, and as much farther as
// time has passed. A change that is real, however fast it was, is therefore believed after a while.
#include "rig/calibration/thermometer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "base/quantity_text.h"

namespace lensd::rig {
namespace {

constexpr double kNoise = 0.5;  ///< degrees by which readings of one temperature differ
constexpr double kWhole = 1.0;  ///< and of a thermometer that reports whole degrees
/// What a DS18B20 reports before its first measurement, and what many devices report whose sensor is gone.
constexpr double kPowerOn = 85.0, kNoSensor = 0.0;
/// Longer than such a sensor takes for a measurement (0.75 s): a number that is reported again after this was measured,
/// if the sensor has ever measured anything.
constexpr Duration kMeasures = std::chrono::seconds(2);
/// A lens that reported its temperature, and reports none for so long, has a fault.
constexpr Duration kSilent = std::chrono::seconds(30);
constexpr const char* kSilentWords = "it reports nothing any more";

bool IsDoubtful(Celsius reading) {
  return reading.value == kPowerOn || reading.value == kNoSensor;
}

double Minutes(Duration time) {
  return std::chrono::duration<double, std::ratio<60>>(time).count();
}

std::string Said(Celsius reading) {
  return "it reports " + Short(reading.value, 4) + " C, ";
}

}  // namespace

void Thermometer::Note(std::optional<Celsius> reading, Instant at) {
  if (!reading) {
    if (!believed_) return;
    if (!silent_since_) silent_since_ = at;
    if (at - *silent_since_ >= kSilent) fault_ = kSilentWords;
    return;
  }
  if (std::exchange(silent_since_, std::nullopt) && fault_ == kSilentWords) fault_.clear();
  std::string why = WhyNot(*reading, at);
  if (why.empty()) return Believe(*reading, at);
  ++left_out_;
  fault_ = std::move(why);
}

/// Empty: it is believed.
std::string Thermometer::WhyNot(Celsius reading, Instant at) {
  if (!std::isfinite(reading.value)) return "it reports no number";
  if (reading < config_.range.first || reading > config_.range.second) {
    doubt_.reset();
    return Said(reading) + "which is outside range_c, " + Short(config_.range.first.value, 4) + " to " +
           Short(config_.range.second.value, 4) + " C";
  }
  const double room = config_.most_per_minute * std::max(Minutes(at - at_), 0.0);
  const bool possible = !believed_ || (reading.value >= lowest_ - room && reading.value <= highest_ + room);
  const double noise = whole_degrees_ ? kWhole : kNoise;
  const bool near = believed_ && std::abs((reading - *believed_).value) <= noise;
  if (IsDoubtful(reading) && !near) {
    if (!doubt_ || doubt_->value != reading) doubt_ = Doubt{reading, at};
    if (!believed_ || at - doubt_->since < kMeasures) {
      return Said(reading) + (reading.value == kPowerOn ? "as a sensor does that has measured nothing yet"
                                                        : "as many devices do whose sensor is gone");
    }
  } else {
    doubt_.reset();
  }
  if (possible) return "";
  return Said(reading) + "too far from the " + Short(believed_->value, 4) + " C before for a change of " +
         Short(config_.most_per_minute, 3) + " C a minute (max_c_per_min)";
}

void Thermometer::Believe(Celsius reading, Instant at) {
  const double room = believed_ ? config_.most_per_minute * std::max(Minutes(at - at_), 0.0) : 0.0;
  whole_degrees_ = whole_degrees_ && reading.value == std::round(reading.value);
  const double noise = whole_degrees_ ? kWhole : kNoise;
  lowest_ = std::max(lowest_ - room, reading.value - noise);
  highest_ = std::min(highest_ + room, reading.value + noise);
  at_ = believed_ ? std::max(at, at_) : at;
  believed_ = reading;
  doubt_.reset();
  fault_.clear();
}

}  // namespace lensd::rig
