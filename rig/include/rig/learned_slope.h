// How the blur of a lens grows with its focus positions, as autofocus runs have shown it against what was told, and
// what each of these runs holds under.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "autofocus/slope_learner.h"
#include "base/result.h"
#include "base/settings.h"
#include "base/units.h"
#include "rig/optics_table.h"

namespace lensd::rig {

/// What blur depends on besides focus. Filter and temperature change it by less than runs scatter.
struct SlopeConditions {
  std::optional<Native> iris{};  ///< nothing: no motorised one
  std::optional<Native> zoom{};  ///< likewise
  double pixel_um = 0.0;         ///< pitch, as told; 0: it or a position is not known, and nothing holds
  enum class Frames { Own, Outside } frames = Frames::Own;
};

/// What one run has shown.
struct SlopeRun {
  static constexpr std::size_t kMost = 200;  ///< that are kept: the newest
  SlopeConditions under{};
  Native position{};               ///< of focus
  double told_px = 0.0;            ///< blur a native unit of focus there, as told at that time, > 0
  double log_factor = 0.0;         ///< of the blur shown over that
  std::optional<double> uneven{};  ///< Verdict::uneven
  std::string made{};              ///< when, for people
};

/// Pixels of blur a native unit of focus, as this table tells; nothing: it does not know it.
std::optional<double> ToldSlope(const OpticsTable& optics, const SlopeConditions& under, Native focus);
/// Whether what was learned under the one holds under the other: frames of the same camera, f-numbers within 5 % and
/// focal lengths within 2 %.
bool SlopeHoldsUnder(const SlopeConditions& one, const SlopeConditions& other, const OpticsTable& optics);

/// What is known of the slope, over the told one, under conditions and by a table; places as extensions in metres.
using KnownSlopes =
    std::function<std::optional<autofocus::KnownSlope>(const SlopeConditions& under, const OpticsTable& optics)>;

/// Of one lens.
class LearnedSlope {
 public:
  LearnedSlope() = default;
  /// From what was kept, in order.
  explicit LearnedSlope(std::vector<SlopeRun> runs);

  /// One more run. What contradicts those under its conditions ends all of them: it is the first of another lens.
  autofocus::SlopeLearner::Learned Add(SlopeRun run, const OpticsTable& optics);
  /// From the newest runs that hold there, each against what `optics` tell of its place: where other optics are told
  /// since, the blur that was seen counts and not its ratio to what was told then. Nothing: too few.
  std::optional<autofocus::KnownSlope> Known(const SlopeConditions& under, const OpticsTable& optics) const;
  const std::vector<SlopeRun>& runs() const { return runs_; }  ///< the newest SlopeRun::kMost, the oldest first

 private:
  autofocus::SlopeLearner LearnerFor(const SlopeConditions& under, const OpticsTable& optics) const;

  std::vector<SlopeRun> runs_;
};

/// The file of what was learned: version = 1, [[run]]. BadData: "file:line: what is wrong".
Result<std::vector<SlopeRun>> ReadLearnedSlope(const Settings& file);
std::string LearnedSlopeText(const std::vector<SlopeRun>& runs);

}  // namespace lensd::rig
