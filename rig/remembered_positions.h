// Where the axes of a rig were last known to be, as the disk has it.
#pragma once

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
  /// On return it outlives a crash. Io: nothing has changed.
  Result<void> Save(drivers::Axis axis, const AxisMemory& now) {
    PositionMemory::Axes all = axes_;
    all[axis] = now;
    if (memory_) {
      if (auto saved = memory_->Save(all); !saved) return saved;
    }
    axes_ = all;
    return {};
  }

 private:
  std::unique_ptr<PositionMemory> memory_;
  PositionMemory::Axes axes_;
  bool readable_ = true;
};

}  // namespace lensd::rig
