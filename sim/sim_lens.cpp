// The simulated lens as drivers/api sees it: what the controller knows of the mechanics, and what the link does to its
// answers.
#include "sim/sim_lens.h"

#include <string>
#include <utility>

namespace lensd::sim {
namespace {

std::unexpected<Error> NoReply() {
  return Fail(Code::Timeout, "the simulated lens did not answer in time, by a [[fault]] of its scene");
}

}  // namespace

SimLens::SimLens(std::shared_ptr<Mechanics> mechanics)
    : Lens(CapabilitiesOf(mechanics->scene().lens)), mechanics_(std::move(mechanics)) {}

SimLens::~SimLens() {
  for (const drivers::Axis axis : drivers::kAxes) {
    if (capabilities().axes[axis]) mechanics_->Halt(axis);
  }
}

Result<void> SimLens::CheckLink() const {
  if (!mechanics_->Disconnected()) return {};
  return Fail(Code::Disconnected, "the simulated lens is disconnected by a [[fault]] of its scene");
}

Result<void> SimLens::Acknowledge() const {
  const Duration now = mechanics_->Now();
  const bool lost = mechanics_->FaultAt(FaultKind::DropReply, now).has_value();
  if (lost || mechanics_->FaultAt(FaultKind::LateReply, now)) return NoReply();
  return {};
}

Result<void> SimLens::DoStartHome(drivers::Axis axis) {
  if (auto link = CheckLink(); !link) return link;
  mechanics_->Home(axis);
  return Acknowledge();
}

Result<void> SimLens::DoStartMove(drivers::Axis axis, Native target) {
  if (auto link = CheckLink(); !link) return link;
  mechanics_->MoveTo(axis, target.value);
  return Acknowledge();
}

Result<void> SimLens::DoStop(drivers::Axis axis) {
  if (auto link = CheckLink(); !link) return link;
  mechanics_->Halt(axis);
  return Acknowledge();
}

Result<drivers::LensState> SimLens::DoRead() {
  if (auto link = CheckLink(); !link) return PassOn(link);
  const Duration now = mechanics_->Now();
  drivers::PerAxis<std::optional<Duration>> frozen;
  for (const drivers::Axis axis : drivers::kAxes) {
    if (const auto stale = mechanics_->FaultAt(FaultKind::StaleReadback, now, axis)) frozen[axis] = BeginOf(*stale);
  }
  drivers::LensState state = mechanics_->Report(frozen);
  if (mechanics_->FaultAt(FaultKind::DropReply, now)) return NoReply();
  if (!mechanics_->FaultAt(FaultKind::LateReply, now)) {
    late_.reset();
    return state;
  }
  // Every answer comes one question too late, and looks as fresh as any.
  std::optional<drivers::LensState> answer = std::exchange(late_, state);
  if (!answer) return NoReply();
  answer->sampled_at = state.sampled_at;
  return *answer;
}

}  // namespace lensd::sim
