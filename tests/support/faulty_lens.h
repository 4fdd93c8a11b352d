// A lens that forwards to another one and goes wrong on demand: a test says what fails, everything else stays real.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "drivers/api/lens.h"

namespace lensd::testing {

/// Faults may be set and cleared from any thread, at any time.
class FaultyLens final : public drivers::Lens {
 public:
  explicit FaultyLens(std::unique_ptr<drivers::Lens> inner) : Lens(inner->capabilities()), inner_(std::move(inner)) {}

  /// What the next `count` calls of any kind do; each kind of fault has its own count.
  enum class Reply {
    Refused,    ///< Protocol; not obeyed
    Dropped,    ///< Timeout; obeyed
    Late,       ///< Timeout and obeyed; a read's answer comes as the answer to the next read
    Duplicate,  ///< the last read's answer comes once more
  };
  void Spoil(Reply reply, int count = 1) {
    const std::lock_guard lock(mutex_);
    spoiled_[reply] = count;
  }
  /// Every call fails with Disconnected while it is off.
  void SetConnected(bool connected) {
    const std::lock_guard lock(mutex_);
    connected_ = connected;
  }
  /// Commands for a stuck axis are acknowledged and not passed on.
  void SetStuck(drivers::Axis axis, bool stuck) {
    const std::lock_guard lock(mutex_);
    stuck_[axis] = stuck;
  }
  /// Adds to every position read: the device has lost count.
  void SetShift(drivers::Axis axis, double by) {
    const std::lock_guard lock(mutex_);
    shift_[axis] = by;
  }
  /// Reads repeat the last answer, with its old time, while it is on.
  void SetStale(bool stale) {
    const std::lock_guard lock(mutex_);
    stale_ = stale;
  }
  /// Commands passed on so far.
  int commands() const {
    const std::lock_guard lock(mutex_);
    return commands_;
  }
  drivers::Lens& inner() { return *inner_; }

 private:
  Result<void> DoStartHome(drivers::Axis axis) override {
    return Command(axis, [&] { return inner_->StartHome(axis); });
  }
  Result<void> DoStartMove(drivers::Axis axis, Native target) override {
    return Command(axis, [&] { return inner_->StartMove(axis, target); });
  }
  Result<void> DoStop(drivers::Axis axis) override {
    return Command(axis, [&] { return inner_->Stop(axis); });
  }
  void DoInterrupt() override { inner_->Interrupt(); }

  Result<drivers::LensState> DoRead() override {
    const std::lock_guard lock(mutex_);
    if (!connected_) return Gone();
    if (Spoils(Reply::Refused)) return Fail(Code::Protocol, "the device refused");
    if (last_ && (stale_ || Spoils(Reply::Duplicate))) return *last_;
    auto state = inner_->Read();
    if (!state) return state;
    for (const drivers::Axis axis : drivers::kAxes) {
      if (state->axes[axis]) state->axes[axis]->position.value += shift_[axis];
    }
    if (Spoils(Reply::Dropped)) return NoReply();
    if (Spoils(Reply::Late)) {
      late_ = *state;
      return NoReply();
    }
    if (late_) {
      state = *late_;
      late_.reset();
    }
    last_ = *state;
    return state;
  }

  template <class Call>
  Result<void> Command(drivers::Axis axis, Call call) {
    const std::lock_guard lock(mutex_);
    if (!connected_) return Gone();
    if (Spoils(Reply::Refused)) return Fail(Code::Protocol, "the device refused");
    if (!stuck_[axis]) {
      ++commands_;
      if (auto done = call(); !done) return done;
    }
    if (Spoils(Reply::Dropped) || Spoils(Reply::Late)) return NoReply();
    return {};
  }

  bool Spoils(Reply reply) {
    int& left = spoiled_[reply];
    if (left == 0) return false;
    --left;
    return true;
  }
  static std::unexpected<Error> Gone() { return Fail(Code::Disconnected, "the lens is unplugged"); }
  static std::unexpected<Error> NoReply() { return Fail(Code::Timeout, "the lens did not answer in time"); }

  const std::unique_ptr<drivers::Lens> inner_;
  mutable std::mutex mutex_;
  std::map<Reply, int> spoiled_;
  bool connected_ = true;
  bool stale_ = false;
  drivers::PerAxis<bool> stuck_;
  drivers::PerAxis<double> shift_;
  std::optional<drivers::LensState> last_;
  std::optional<drivers::LensState> late_;
  int commands_ = 0;
};

}  // namespace lensd::testing
