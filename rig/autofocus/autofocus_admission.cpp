// Which frames of a run reach its search, by the gate; those that do not are kept for the answer.
#include <algorithm>
#include <string_view>
#include <utility>

#include "rig/autofocus/autofocus_run.h"

namespace lensd::rig {

namespace {

constexpr const char* kReplaced = "another one was to be taken in its place";
constexpr const char* kMayBeLate = "it may show where the lens was before";
constexpr const char* kOfTheSearchBefore = "the search began anew after it";

bool IsBad(const LeftOutFrame& frame) {
  constexpr std::string_view kSound[] = {autofocus::kTakenTwice, autofocus::kDoubtedInVain, kReplaced, kMayBeLate,
                                         kOfTheSearchBefore};
  return std::ranges::find(kSound, frame.reason) == std::end(kSound);
}

}  // namespace

/// What becomes of a frame; of one of an end that it confirmed, or on the way back, nothing.
Result<AutofocusRun::Admission> AutofocusRun::Admit(const Observation& seen, const autofocus::Place& place) {
  using Kind = autofocus::Judgement::Kind;
  const int now = search_.taken - 1;
  if (seen.score) {
    if (!search_.gate.ThrowsAwayScore(place)) return Admission::Used;
    LeaveOut(now, stands_, search_.gate.WhyThrownAway());
    return Admission::Again;
  }
  const autofocus::Judgement judged = search_.ends_with ? search_.gate.JudgeAtRest(seen.lensed.frame)
                                                        : search_.gate.Judge(place, seen.lensed.frame, regions());
  if (!judged.before_is_bad.empty()) {
    const bool was_used = !search_.frames.empty() && search_.frames.back().frame == now - 1;
    if (was_used) search_.newest_is_bad = judged.before_is_bad;
    if (!was_used) LeaveOut(now - 1, stands_, judged.before_is_bad);
  }
  if (judged.kind == Kind::Late) {
    LeaveOut(now, stands_, kMayBeLate);
    GoBack(Refusal(autofocus::Cause::LateFrames,
                   "the picture is late by more frames than could be thrown away: throw frames away after each move, "
                   "until they show where the lens stands"));
    return Admission::Ended;
  }
  if (judged.kind == Kind::AskAgain) {
    LeaveOut(now, stands_, kReplaced);
    return Admission::Again;
  }
  if (const auto verdict = std::exchange(search_.ends_with, std::nullopt); verdict && judged.kind == Kind::Use) {
    LeaveOut(now, stands_, autofocus::kTakenTwice);
    EndWith(*verdict);
    return Admission::Ended;
  }
  if (judged.kind == Kind::UseAnew) {
    if (auto begun = BeginAnew(); !begun) return PassOn(begun);
  }
  search_.newest_is_bad.clear();
  return Admission::Used;
}

/// The frame at hand will be the first of a new search; time, moves and frames go on.
Result<void> AutofocusRun::BeginAnew() {
  auto plan = plan_anew_();
  if (!plan) return PassOn(plan);
  search_.plan.regions = std::move(plan->regions);
  for (const AutofocusSample& used : search_.frames) LeaveOut(used.frame, used.position, kOfTheSearchBefore);
  if (!search_.newest_is_bad.empty()) LeaveOut(search_.frames.back().frame, {}, search_.newest_is_bad);
  search_.frames.clear();
  return {};
}

/// Of each frame the newest reason counts, and the first position.
void AutofocusRun::LeaveOut(int frame, Native position, const std::string& reason) {
  const auto at = std::ranges::lower_bound(search_.left_out, frame, {}, &LeftOutFrame::frame);
  if (at == search_.left_out.end() || at->frame != frame) {
    search_.left_out.insert(at, {frame, position, reason});
  } else {
    at->reason = reason;
  }
}

/// The frames that were no good, for people.
std::string AutofocusRun::WithLeftOut(std::string reason) const {
  constexpr std::size_t kMost = 3;
  std::vector<LeftOutFrame> bad = search_.left_out;
  std::erase_if(bad, [](const LeftOutFrame& frame) { return !IsBad(frame); });
  if (bad.empty()) return reason;
  reason += bad.size() == 1 ? "; a frame was left out and taken again: "
                            : "; " + std::to_string(bad.size()) + " frames were left out and taken again: ";
  for (std::size_t i = 0; i < std::min(kMost, bad.size()); ++i) {
    reason += std::string(i > 0 ? "; " : "") + "frame " + std::to_string(bad[i].frame + 1) + ", " + bad[i].reason;
  }
  return bad.size() > kMost ? reason + ", and so on" : reason;
}

}  // namespace lensd::rig
