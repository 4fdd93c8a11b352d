// Remembered positions on disk: one small JSON file for each lens in the state folder.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "daemon/threads/stop_signal.h"
#include "rig/position_memory.h"

namespace lensd::daemon {

/// What a file of positions says.
struct KeptPositions {
  rig::PositionMemory::Axes axes;
  drivers::PerAxis<bool> left;  ///< by a command, and by no other program since
};

/// FOLDER/NAME[-SERIAL].position.json, keyed by the lens' name and, where it has one, its serial number: another lens
/// under the same name starts with nothing remembered. Always whole: replaced by way of a temporary file that is
/// flushed before it takes the name, and the folder after. The disk is written by a thread of its own, because a stop
/// must not wait for it. Of several stores of one file only the newest writes: one whose signal is severed puts nothing
/// in its place any more, however late its disk comes back.
class PositionStore final : public rig::PositionMemory {
 public:
  PositionStore(const std::string& folder, const std::string& lens, const std::string& serial,
                std::shared_ptr<StopSignal> stops);
  /// Waits until what was to be written is.
  ~PositionStore() override;

  /// Reads once, until something is saved: who asks twice hears the same.
  Result<Axes> Load() override;
  /// Cancelled: a stop came first; what was saved before stays, or comes back.
  Result<void> Save(const Axes& axes) override;

  /// As last read or saved: where an axis stands, or stood before it was sent elsewhere, if a command has left it there
  /// and no other program has moved it since.
  drivers::PerAxis<std::optional<Native>> left() const;

  const std::string& path() const { return path_; }

 private:
  /// What the thread has to do, and how far it is; under the signal's lock.
  struct Work {
    std::optional<std::string> next;
    bool writing = false;
    bool quit = false;
    std::uint64_t asked = 0;    ///< number of the newest text
    std::uint64_t written = 0;  ///< of the newest one written, or tried to be
    Result<void> result;        ///< of that one
  };
  Result<KeptPositions> Read() const;
  bool LeftBy(const Axes& axes, drivers::Axis axis) const;
  void Write();
  Result<void> WriteOne(const std::string& text);

  std::string lens_;
  std::string serial_;
  std::string path_;
  std::optional<Result<Axes>> loaded_;
  KeptPositions kept_;           ///< as last read or saved
  drivers::PerAxis<bool> sent_;  ///< this store has saved that it moves
  std::string saved_;            // what Save() last reported as written; empty: nothing yet
  std::shared_ptr<StopSignal> stops_;
  std::shared_ptr<std::mutex> place_;  // held while the file is read or takes the place of another; of all its stores
  Work work_;
  std::jthread thread_;  // last: it uses the others
};

}  // namespace lensd::daemon
