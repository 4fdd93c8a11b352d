// What positions mean for the picture, and which way they count: what may change of that while the rig runs, and what
// cannot be done without it.
#include <utility>

#include "rig/impl.h"

namespace lensd::rig {

using drivers::Axis;

void Rig::Impl::SetCalibration(std::shared_ptr<const Calibration> calibration, StopCallback done) {
  // The run holds the table of the old one.
  auto possible = OpticalState::TableFor(optics.config(), device, calibration);
  if (!possible) return replies.Add(std::move(done), Result<void>(PassOn(possible)));
  autofocus.Cancel({Code::Superseded, "the lens got another calibration"});
  optics.Adopt(*std::move(possible), std::move(calibration));
  if (reader.sampled_at()) optics.NoteConditions(reader.temperature());
  replies.Add(std::move(done), Result<void>());
}

void Rig::Impl::SetSeenDirection(std::optional<drivers::Direction> seen, StopCallback done) {
  const auto refuse = [&](Error why) { replies.Add(std::move(done), Result<void>(PassOn(std::move(why)))); };
  if (!axes[Axis::Focus]) return refuse({Code::Unsupported, "this lens has no motorised focus"});
  if (auto moving = WhyNotAtRest()) return refuse(*std::move(moving));
  RigConfig config = optics.config();
  config.axes[Axis::Focus].seen = seen;
  auto table = OpticalState::TableFor(config, device, optics.calibration());
  if (!table) return refuse(table.error());
  optics.Adopt(*std::move(table), seen);
  if (reader.sampled_at()) optics.NoteConditions(reader.temperature());
  replies.Add(std::move(done), Result<void>());
}

/// Of several regions the nearest, or the farthest, gives the answer: that takes a direction.
Result<void> Rig::Impl::CheckPolicy(const AutofocusRequest& request) const {
  const bool ranks = request.regions.size() > 1 && !request.map && request.policy != autofocus::Policy::Widest;
  if (!ranks || !axes[Axis::Focus] || axes[Axis::Focus]->setup().direction.direction) return {};
  return PassOn(DirectionUnknown("autofocus cannot know which of several regions is nearest"));
}

}  // namespace lensd::rig
