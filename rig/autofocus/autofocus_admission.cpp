// Which frames of a run reach its search, by the gate; those that do not are kept for the answer.
#include <algorithm>
#include <utility>

#include "rig/autofocus/autofocus_run.h"

namespace lensd::rig {

/// What becomes of a frame; of one of an end that it confirmed, or on the way back, nothing.
Result<AutofocusRun::Admission> AutofocusRun::Admit(const Observation& seen, const autofocus::Place& place) {
  using Kind = autofocus::Judgement::Kind;
  if (seen.score) return search_.gate.ThrowsAwayScore(place) ? Admission::Again : Admission::Used;
  const autofocus::Judgement judged = search_.ends_with ? search_.gate.JudgeAtRest(seen.lensed.frame)
                                                        : search_.gate.Judge(place, seen.lensed.frame, regions());
  if (!judged.before_is_bad.empty()) {
    search_.left_out.push_back({search_.taken - 2, search_.before, judged.before_is_bad});
  }
  search_.before = stands_;
  if (judged.kind == Kind::Late) {
    GoBack(Refusal(autofocus::Cause::LateFrames,
                   "the picture is late by more frames than could be thrown away: throw frames away after each move, "
                   "until they show where the lens stands"));
    return Admission::Ended;
  }
  if (judged.kind == Kind::AskAgain) return Admission::Again;
  if (const auto verdict = std::exchange(search_.ends_with, std::nullopt); verdict && judged.kind == Kind::Use) {
    search_.left_out.push_back({search_.taken - 1, stands_, autofocus::kTakenTwice});
    EndWith(*verdict);
    return Admission::Ended;
  }
  if (judged.kind == Kind::UseAnew) {
    if (auto begun = BeginAnew(); !begun) return PassOn(begun);
  }
  return Admission::Used;
}

/// The frame at hand will be the first of a new search; time, moves and frames go on.
Result<void> AutofocusRun::BeginAnew() {
  auto plan = plan_anew_();
  if (!plan) return PassOn(plan);
  search_.plan.regions = std::move(plan->regions);
  search_.frames.clear();
  return {};
}

/// The frames that were no good, for people.
std::string AutofocusRun::WithLeftOut(std::string reason) const {
  constexpr std::size_t kMost = 3;
  std::vector<LeftOutFrame> bad = search_.left_out;
  std::erase_if(bad, [](const LeftOutFrame& frame) { return frame.reason == autofocus::kTakenTwice; });
  if (bad.empty()) return reason;
  reason += bad.size() == 1 ? "; a frame was left out and taken again: "
                            : "; " + std::to_string(bad.size()) + " frames were left out and taken again: ";
  for (std::size_t i = 0; i < std::min(kMost, bad.size()); ++i) {
    reason += std::string(i > 0 ? "; " : "") + "frame " + std::to_string(bad[i].frame + 1) + ", " + bad[i].reason;
  }
  return bad.size() > kMost ? reason + ", and so on" : reason;
}

}  // namespace lensd::rig
