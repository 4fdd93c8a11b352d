// Where the axes stand: who may say it when, and what cannot be done while nobody knows.
#include <algorithm>
#include <string>
#include <utility>

#include "rig/impl.h"

namespace lensd::rig {

using drivers::Axis;

// ---- a place that is said -----------------------------------------------------------------------------------------

void Rig::Impl::SetPosition(Axis axis, Native position, StopCallback done) {
  auto said = Say(axis, position);
  if (said) {
    reader.ForgetHistory();
    if (axis == Axis::Focus) optics.Hold({});  // what it was held at is another place now
    optics.NoteConditions(reader.temperature());
  }
  replies.Add(std::move(done), std::move(said));
}

/// By what the device counts now.
Result<void> Rig::Impl::Say(Axis axis, Native position) {
  if (!axes[axis]) return Fail(Code::Unsupported, "this lens has no motorised " + std::string(AxisName(axis)));
  const auto before = reader.count();
  ReadLens();
  if (auto busy = WhyNotFocused()) return PassOn(*std::move(busy));
  if (reader.problem()) return Fail(Code::Disconnected, "the lens does not answer: " + reader.problem()->message);
  if (reader.count() == before || !axes[axis]->state()) {
    return Fail(Code::Timeout, "the lens did not report its count: try again");
  }
  return axes[axis]->Say(position);
}

/// What optics decide needs the place of the axis, and of the zoom and filter that the table is for.
std::optional<Error> Rig::Impl::WhyMeaningless(Axis axis, const Target& target) const {
  using Kind = Target::Kind;
  if (target.kind == Kind::Native || target.kind == Kind::NativeRelative || target.kind == Kind::TowardNear) return {};
  for (const Axis needed : {axis, Axis::Zoom, Axis::Filter}) {
    if (!axes[needed] || (needed != axis && axis != Axis::Focus)) continue;
    const auto now = axes[needed]->state() ? std::optional(axes[needed]->Describe(false)) : std::nullopt;
    if (auto lost = WhyLost(needed, now)) return lost;
  }
  return std::nullopt;
}

// ---- what must end first ------------------------------------------------------------------------------------------

std::optional<Error> Rig::Impl::WhyNotFocused() const {
  const auto busy = [](const char* what, const char* activity) {
    return Fail(Code::Busy, std::string(what) + ": wait for its end, or stop it",
                {.axis = "focus", .activity = activity})
        .error();
  };
  const auto occupied = procedure.lock();
  if (occupied && occupied->kind == Activity::Kind::Backlash) {
    return busy("the backlash of this lens is being measured", "backlash");
  }
  if (occupied || autofocus.running()) return busy("an autofocus is under way", "autofocus");
  return std::nullopt;
}

std::optional<Error> Rig::Impl::WhyNotAtRest() const {
  if (auto focusing = WhyNotFocused()) return focusing;
  for (const Axis axis : drivers::kAxes) {
    if (!axes[axis]) continue;
    const AxisMotion* motion = axes[axis]->motion();
    // A motor also moves by hand, by another program, and a little after a stop.
    const bool moving = reader.connected() && axes[axis]->state() && axes[axis]->moving();
    if (motion == nullptr && !moving) continue;
    const std::string name(AxisName(axis));
    return Fail(Code::Busy, name + " is moving: wait until it has come to rest, or stop it",
                {.axis = name, .activity = motion != nullptr && motion->homing() ? "homing" : "moving"})
        .error();
  }
  return std::nullopt;
}

}  // namespace lensd::rig
