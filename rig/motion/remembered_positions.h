// Where the axes of a rig were last known to be, as the disk has it.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <utility>

#include "rig/position_memory.h"

namespace lensd::rig {

/// Without a memory it keeps everything for as long as the rig lives.
class RememberedPositions {
 public:
  explicit RememberedPositions(std::unique_ptr<PositionMemory> memory) : memory_(std::move(memory)) {
    if (!memory_) return;
    auto loaded = memory_->Load();
    readable_ = loaded.has_value();
    if (loaded) axes_ = *loaded;
  }

  /// False: there is a memory, and it cannot be read.
  bool readable() const { return readable_; }
  const std::optional<AxisMemory>& operator[](drivers::Axis axis) const { return axes_[axis]; }
  /// On return it outlives a crash. Io: nothing has changed. Cancelled: a stop came first.
  Result<void> Save(drivers::Axis axis, const AxisMemory& now) {
    PositionMemory::Axes all = axes_;
    all[axis] = now;
    if (memory_) {
      if (auto saved = memory_->Save(all); !saved) return saved;
    }
    axes_ = all;
    unkept_[axis].reset();
    return {};
  }
  /// The same for an axis that rests, which may be tried again later: what failed is remembered, and not tried at every
  /// reading.
  enum class Try { Now, WhenDue };
  void SaveRest(drivers::Axis axis, const AxisMemory& now, Instant at, Try when) {
    auto& unkept = unkept_[axis];
    if (when == Try::WhenDue && unkept && at < tried_at_ + kTryAgainAfter) return;
    const auto saved = Save(axis, now);
    if (saved || saved.error().code == Code::Cancelled) return;
    tried_at_ = at;
    unkept = Unkept{unkept ? unkept->since : at, saved.error().message};
  }
  /// The disk has what is true of it.
  void Agrees(drivers::Axis axis) { unkept_[axis].reset(); }
  /// What of an axis is not on disk, though it rests there; nothing: it is.
  const std::optional<Unkept>& unkept(drivers::Axis axis) const { return unkept_[axis]; }
  /// Whether an axis moves as far as the disk knows.
  bool InMotion(drivers::Axis axis) const { return memory_ && axes_[axis] && axes_[axis]->in_motion; }
  bool keeps() const { return memory_ != nullptr; }

 private:
  static constexpr Duration kTryAgainAfter = std::chrono::milliseconds(500);

  std::unique_ptr<PositionMemory> memory_;
  PositionMemory::Axes axes_;
  drivers::PerAxis<std::optional<Unkept>> unkept_;
  Instant tried_at_{};
  bool readable_ = true;
};

}  // namespace lensd::rig
