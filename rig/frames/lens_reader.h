// What the lens says of itself, and whether it says anything.
#pragma once

#include <cstdint>
#include <optional>

#include "base/clock.h"
#include "rig/calibration/thermometer.h"
#include "rig/frames/history.h"
#include "rig/motion/axis_controller.h"

namespace lensd::rig {

struct Status;

/// Reads all axes at once and hands each its part.
class LensReader {
 public:
  /// All must outlive it.
  LensReader(drivers::Lens& lens, const AxisControllers& axes, const RigConfig& config, const Clock& clock);

  /// Why the lens does not answer, where this reading has failed for good: nothing that waits for it will be.
  std::optional<Error> Read();
  /// Reads soon, though no caller waits for it.
  void ReadSoon() { next_read_ = clock_.Now(); }

  /// A command found the link broken: of no axis is it known what happened meanwhile.
  void NoteBrokenLink();

  /// Nothing while it answers.
  const std::optional<Error>& problem() const { return problem_; }
  bool connected() const { return sampled_at_ && !problem_; }
  /// Of the newest reading; nothing before the first.
  std::optional<Instant> sampled_at() const { return sampled_at_; }
  std::optional<Celsius> temperature() const { return thermometer_.believed(); }
  /// Adds the temperature, and what is wrong with it.
  void Describe(Status& status) const;
  Instant next_read() const { return next_read_; }
  const History& history() const { return history_; }
  /// Readings that came so far.
  std::uint64_t count() const { return count_; }
  /// Positions of before mean another place from now on.
  void ForgetHistory() { history_.Clear(); }
  bool Moving() const;
  /// Since when no axis has moved; nothing while one does or the lens does not answer.
  std::optional<Instant> SteadySince() const;

 private:
  void Note(drivers::LensState reading);
  bool AsksAgain(Code code, Instant now) const;

  drivers::Lens& lens_;
  const AxisControllers& axes_;
  const Clock& clock_;
  Duration latency_{};
  History history_;
  std::optional<Instant> sampled_at_;
  Thermometer thermometer_;
  std::optional<Error> problem_;
  struct {
    int failures = 0;                        ///< in a row
    std::optional<Instant> busy_since = {};  ///< it has answered nothing but that it is busy
    Instant heard_at{};                      ///< when it last answered, if only that it is busy
  } unread_;
  std::uint64_t count_ = 0;
  Instant next_read_{};
};

}  // namespace lensd::rig
