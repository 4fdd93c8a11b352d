// A conflict is put to the positions of the lens: all of them, where it does not name what kept some out. Where a pair
// of them meets it, it lacks what that pair breaks.
#include "optics/positions/position_conflict.h"

#include <algorithm>
#include <optional>

#include "optics/planner/certain_conflict.h"
#include "optics/planner/limit_lines.h"
#include "optics/planner/minimal_conflict.h"

namespace lensd::optics {

namespace {

/// Beyond all there is, in metres and as an f-number.
constexpr double kAnything = 1e9;

class Positions {
 public:
  Positions(const PlanRequest& request, const LensPositions& lens, const FocusBlocks& blocks,
            const DistanceOrigin& origin)
      : request_(request),
        lens_(lens),
        blocks_(blocks),
        origin_(origin),
        blur_(request, lens, origin),
        admitted_(ChoiceOf(request, lens, blocks, blur_)),
        bare_(request) {
    bare_.limits.clear();
  }

  std::optional<std::vector<int>> Refute(const std::vector<int>& names) const {
    const PlanRequest part = Part(names);
    const PositionBlur blur(part, lens_, origin_);
    const PositionChoice choice = ChoiceOf(part, lens_, blocks_, blur);
    const PositionPair pair = BestPair(part, lens_, blocks_, blur, choice);
    if (pair.ratio > kPositionHolds || !choice.focus_reachable) return std::nullopt;
    return BrokenAt(pair);
  }

 private:
  /// What `names` ask. The depth of field is that of a fixed focus.
  PlanRequest Part(const std::vector<int>& names) const {
    const auto has = [&](int name) { return std::ranges::find(names, name) != names.end(); };
    PlanRequest part = bare_;
    for (const int name : names) {
      if (name >= 0) part.limits.push_back(request_.limits[static_cast<std::size_t>(name)]);
    }
    if (!has(kExtensionName)) part.extensions = {-kAnything, kAnything};
    if (!has(kFNumberName)) {
      part.stops.clear();
      part.f_numbers = {1.0 / kAnything, kAnything};
    }
    if (part.objective == Objective::Depth) return part;
    if (!has(kFocusName)) part.focus.reset();
    return part;
  }

  /// The limit that fares worst there, and what keeps these positions out.
  std::vector<int> BrokenAt(const PositionPair& pair) const {
    std::vector<int> broken;
    if (!admitted_.focus.Contains(pair.focus)) broken.push_back(request_.focus ? kFocusName : kExtensionName);
    if (std::ranges::find(admitted_.iris, pair.iris) == admitted_.iris.end()) broken.push_back(kFNumberName);
    const auto [low, high] = blur_.FNumbers(lens_.iris[pair.iris]);
    double most = kPositionHolds;
    std::optional<std::size_t> worst;
    for (std::size_t k = 0; k < blur_.limits(); ++k) {
      const double ratio = blur_.Need(k, lens_.focus[pair.focus]).Ratio(low, high);
      if (ratio > most) most = ratio, worst = k;
    }
    if (worst) broken.push_back(static_cast<int>(*worst));
    return broken;
  }

  const PlanRequest& request_;
  const LensPositions& lens_;
  const FocusBlocks& blocks_;
  const DistanceOrigin& origin_;
  PositionBlur blur_;
  PositionChoice admitted_;
  PlanRequest bare_;  ///< without limits
};

}  // namespace

std::vector<std::string> ConflictOnPositions(const PlanRequest& request, const LensPositions& lens,
                                             const FocusBlocks& blocks, const DistanceOrigin& origin,
                                             const std::vector<std::string>& conflict) {
  const Positions positions(request, lens, blocks, origin);
  return Spelled(request, CertainConflict(Numbered(request, conflict), EveryName(request),
                                          [&](const std::vector<int>& names) { return positions.Refute(names); }));
}

}  // namespace lensd::optics
