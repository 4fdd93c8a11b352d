// Frames made on a thread of their own, so that a rig which polls a camera never waits for a renderer.
#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>

#include "drivers/api/thread_barrier.h"
#include "sim/camera/frame_maker.h"

namespace lensd::sim {

/// Takes one shot at a time. One thread calls everything; the work is done on another, which starts with the first shot
/// and ends with the darkroom.
class Darkroom {
 public:
  /// `maker` must outlive the darkroom and be used by nothing else.
  explicit Darkroom(FrameMaker& maker) : maker_(maker) {}
  /// Cancels what is being made and waits until that has been heard (RenderOptions::stop).
  ~Darkroom();

  struct Developed {
    Exposure exposure;
    Result<Samples> samples;
  };
  /// Whether a shot is being made or waits to be taken. Throws what the renderer threw.
  bool busy() const;
  /// Begins with a shot; not while busy.
  void Submit(Shot shot);
  /// What has been made, once; none while it is being made.
  std::optional<Developed> Take();
  /// Drops the shot, being made or done.
  void Cancel();

 private:
  void Work(const std::stop_token& end);
  void Develop(const Shot& shot, const std::stop_token& stop);

  FrameMaker& maker_;
  mutable std::mutex mutex_;
  std::condition_variable_any wake_;
  std::optional<Shot> next_;
  std::optional<Developed> done_;
  std::optional<std::stop_source> under_way_;
  drivers::ThreadBarrier barrier_;
  std::jthread thread_;  ///< last: it uses everything above
};

}  // namespace lensd::sim
