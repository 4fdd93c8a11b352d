// Which frames of a run reach its search, by the gate; those that do not are kept for the answer.
#include <algorithm>
#include <utility>

#include "autofocus_run.h"

namespace lensd::rig {

/// Whether the search gets the frame; otherwise another one is to be taken, unless the lens is on its way back already.
Result<bool> AutofocusRun::Admit(const Observation& seen, const autofocus::Place& place) {
  using Kind = autofocus::Judgement::Kind;
  if (seen.score) return true;
  const autofocus::Judgement judged = search_.refusal ? search_.gate.JudgeChanged(seen.lensed.frame)
                                                      : search_.gate.Judge(place, seen.lensed.frame, regions());
  if (!judged.before_is_bad.empty()) {
    search_.left_out.push_back({search_.taken - 2, search_.before, judged.before_is_bad});
  }
  search_.before = stands_;
  if (judged.kind == Kind::Late) {
    GoBack(Refusal(autofocus::Cause::LateFrames,
                   "the picture is one move late, or more: throw away a frame after each move"));
    return false;
  }
  if (judged.kind == Kind::AskAgain) return false;
  if (const auto refusal = std::exchange(search_.refusal, std::nullopt); refusal && judged.kind == Kind::Use) {
    GoBack(Outcome(*refusal));
    return false;
  }
  if (judged.kind == Kind::UseAnew) {
    if (auto begun = BeginAnew(); !begun) return PassOn(begun);
  }
  return true;
}

/// The frame at hand will be the first of a new search; time, moves and frames go on.
Result<void> AutofocusRun::BeginAnew() {
  auto plan = plan_anew_();
  if (!plan) return PassOn(plan);
  search_.plan.regions = std::move(plan->regions);
  search_.frames.clear();
  return {};
}

/// The frames that were not used, for people.
std::string AutofocusRun::WithLeftOut(std::string reason) const {
  constexpr std::size_t kMost = 3;
  const auto& left_out = search_.left_out;
  if (left_out.empty()) return reason;
  reason += left_out.size() == 1 ? "; a frame was left out and taken again: "
                                 : "; " + std::to_string(left_out.size()) + " frames were left out and taken again: ";
  for (std::size_t i = 0; i < std::min(kMost, left_out.size()); ++i) {
    reason +=
        std::string(i > 0 ? "; " : "") + "frame " + std::to_string(left_out[i].frame + 1) + ", " + left_out[i].reason;
  }
  return left_out.size() > kMost ? reason + ", and so on" : reason;
}

}  // namespace lensd::rig
