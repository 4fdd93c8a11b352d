// The part of a rig that remembers positions: on disk before a motor turns, and again when it stands.
#include <algorithm>
#include <cmath>
#include <utility>

#include "impl.h"

namespace lensd::rig {

using drivers::Axis;

/// At the first reading: what the memory makes of it.
void Rig::Impl::Recall(const drivers::LensState& state) {
  if (!memory_) return;
  auto loaded = memory_->Load();
  if (loaded) remembered_ = *loaded;
  for (const Axis axis : drivers::kAxes) {
    if (!tracks_[axis] || !state.axes[axis]) continue;
    if (!loaded) {
      tracks_[axis]->Forget();
    } else if (remembered_[axis]) {
      tracks_[axis]->Recall(*remembered_[axis], *state.axes[axis]);
      SetLimits(*setups_[axis], tracks_[axis]->offset());
    }
  }
}

/// Why an axis may not be sent to a position: it means nothing, and a search of the reference would tell.
std::optional<Error> Rig::Impl::PositionUnknown(Axis axis) const {
  if (Known(axis) || !setups_[axis]->can.can_home) return std::nullopt;
  const std::string name(AxisName(axis));
  return Error{Code::Unsupported,
               "the position of " + name + " is not known since lensd ended in mid-move: home it first"};
}

/// The motor may turn, somewhere from `lowest` to `highest`. Io: the disk does not take it, and it must not turn.
Result<void> Rig::Impl::RememberMotion(Axis axis, Native lowest, Native highest) {
  if (!memory_) return {};
  const auto& before = remembered_[axis];
  if (before && before->in_motion && before->lowest <= lowest && before->highest >= highest) return {};
  const AxisSetup& setup = *setups_[axis];
  AxisMemory motion = tracks_[axis]->Remember(state_->axes[axis]->position);
  motion.in_motion = true;
  motion.lowest = std::max(lowest, setup.minimum);
  motion.highest = std::min(highest, setup.maximum);
  if (before && before->in_motion) {
    // Sent elsewhere in mid-move: where it turns is not known, and more of this shall not cost a write each.
    motion.position = before->position;
    motion.lowest = setup.minimum;
    motion.highest = setup.maximum;
    if (before->lowest <= motion.lowest && before->highest >= motion.highest) return {};
  }
  PositionMemory::Axes all = remembered_;
  all[axis] = motion;
  if (auto saved = memory_->Save(all); !saved) {
    return Fail(Code::Io, "nothing was moved, because the position could not be remembered: " + saved.error().message);
  }
  remembered_ = all;
  return {};
}

/// It stands. Where the disk does not take that now, the next reading tries again; until then it counts as in motion.
void Rig::Impl::RememberRest(Axis axis) {
  if (!memory_) return;
  const AxisMemory rest = tracks_[axis]->Remember(state_->axes[axis]->position);
  const auto& before = remembered_[axis];
  const bool same = before && !before->in_motion && before->known == rest.known &&
                    std::abs((before->position - rest.position).value) <= tolerances_[axis];
  if (same) return;
  PositionMemory::Axes all = remembered_;
  all[axis] = rest;
  if (memory_->Save(all)) remembered_ = all;
}

}  // namespace lensd::rig
