// Answers for several motions at once, such as homing a lens or applying a plan.
#include "daemon/lens/move_group.h"

#include <utility>

#include "daemon/wire/lens_json.h"

namespace lensd::daemon {

using drivers::Axis;

rig::MoveCallback MoveGroup::Add() {
  ++outstanding_;
  return [self = shared_from_this()](const Result<rig::MoveOutcome>& outcome) {
    if (!outcome && self->moves_) self->moves_ = PassOn(outcome);
    if (outcome && self->moves_) self->moves_->push_back(*outcome);
    self->EndOne();
  };
}

void MoveGroup::EndOne() {
  if (--outstanding_ == 0) done_(std::move(moves_));
}

void HomeAxes(rig::Rig& rig, std::optional<Axis> only, MovesCallback done) {
  std::vector<Axis> axes;
  for (const Axis axis : drivers::kAxes) {
    const auto& can = rig.lens().axes[axis];
    if (only ? axis == *only : can && can->can_home) axes.push_back(axis);
  }
  if (axes.empty()) return done(Fail(Code::Unsupported, "no axis of this lens has a reference to search for"));
  const auto group = std::make_shared<MoveGroup>(std::move(done));
  for (const Axis axis : axes) rig.Home(axis, group->Add());
  group->Complete();
}

varlink::Json MovesJson(const std::string& lens, const Moves& moves) {
  varlink::Json json = varlink::Json::array();
  for (const rig::MoveOutcome& move : moves) json.push_back(MoveJson(lens, move));
  return json;
}

}  // namespace lensd::daemon
