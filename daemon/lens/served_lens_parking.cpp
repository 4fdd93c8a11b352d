// The end of lensd: axes that have a place to park go there, where that is safe and no hold or lease is against it. A
// lens that is stopped for good, complains, or does not know where it stands is left as it is, and that is said.
#include <memory>
#include <string>
#include <utility>

#include "daemon/events/log.h"
#include "daemon/lens/served_lens.h"

namespace lensd::daemon {
namespace {

/// Empty: it may go there.
std::string WhyNotParked(const rig::Status& status, drivers::Axis axis) {
  const auto& now = status.axes[axis];
  if (!status.connected) return "the lens does not answer";
  if (!now) return "this lens has no such axis";
  if (!now->fault.empty()) return "it has a fault: " + now->fault;
  if (!now->homed) return "its position is not known: it was not homed";
  return "";
}

}  // namespace

/// Whether it goes. Then it ends once it is there, or cannot get there, or that has taken too long.
bool ServedLens::GoToPark() {
  std::vector<drivers::Axis> axes;
  for (const drivers::Axis axis : drivers::kAxes) {
    if (config_.rig.axes[axis].park) axes.push_back(axis);
  }
  if (axes.empty()) return false;
  if (!worker_) {
    Log(Severity::Warning, Event::NotParked, "not parked: " + shown_.status->problem, name());
    return false;
  }
  opening_.life = Life::Parking;
  // Every caller is answered before anything else moves.
  const auto stop = [](rig::Rig& rig, auto done) { rig.Stop({}, std::move(done)); };
  worker_->SubmitStop(Answered<void>(stop, [this, axes](const Result<void>&) { Park(axes); }, kStopAtMost));
  surroundings_.loop.After(kParkAtMost, [this] {
    if (opening_.life != Life::Parking) return;
    Log(Severity::Warning, Event::NotParked, "not parked within 10 s: it stops where it is", name());
    End(opening_.why_ending);
  });
  return true;
}

void ServedLens::Park(const std::vector<drivers::Axis>& axes) {
  if (opening_.life != Life::Parking) return;
  const auto left = std::make_shared<std::size_t>(1);
  const auto one_less = [this, left] {
    if (--*left == 0 && opening_.life == Life::Parking) End(opening_.why_ending);
  };
  for (const drivers::Axis axis : axes) {
    const auto tell = [this, axis](const std::string& why) {
      const auto name_of_axis = drivers::AxisName(axis);
      Log(Severity::Warning, Event::NotParked, std::string(name_of_axis) + " is not parked: " + why,
          {.lens = name(), .axis = name_of_axis});
    };
    const std::string why =
        users_->stops.latched() ? "the lens was stopped for good" : WhyNotParked(*shown_.status, axis);
    if (!why.empty()) {
      tell(why);
      continue;
    }
    ++*left;
    const rig::Target target{
        .kind = rig::Target::Kind::Native, .value = config_.rig.axes[axis].park->value, .from = {}, .take_up = {}};
    const auto move = [axis, target](rig::Rig& rig, auto done) { rig.Move(axis, target, std::move(done)); };
    (void)worker_->Submit(Answered<rig::MoveOutcome>(move, [tell, one_less](const Result<rig::MoveOutcome>& moved) {
      if (!moved) tell(moved.error().message);
      if (moved && !moved->reached) tell(moved->reason);
      one_less();
    }));
  }
  one_less();
}

}  // namespace lensd::daemon
