#include "move_group.h"

#include "lens_json.h"

namespace lensd::daemon {

rig::MoveCallback MoveGroup::Add() {
  ++outstanding_;
  return [self = shared_from_this()](const Result<rig::MoveOutcome>& outcome) {
    if (outcome) {
      self->moves_.push_back(MoveJson(self->lens_, *outcome));
      self->outcomes_.push_back(*outcome);
    }
    if (!outcome && !self->error_) self->error_ = outcome.error();
    self->EndOne();
  };
}

void MoveGroup::Fail(Error error) {
  error_ = std::move(error);
  EndOne();
}

void MoveGroup::EndOne() {
  if (--outstanding_ == 0) worker_.Later([self = shared_from_this()] { self->ended_(*self); });
}

}  // namespace lensd::daemon
