// The files that are kept of the lenses, each written whole, and what of them is not on disk yet.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "daemon/config/file_mark.h"
#include "daemon/threads/task_thread.h"
#include "loop/event_loop.h"

namespace lensd::daemon {

/// Whose file it is, and what it holds, for people.
struct KeptFile {
  std::string path;  ///< empty: nothing is kept
  std::string lens;
  std::string what;  ///< "its calibration"
  /// What becomes of a text that cannot be written. InForce: the lens goes by it all the same, so that it is tried
  /// again when lensd ends. Undone: whoever asked for it hears that it was not done.
  enum class Otherwise { InForce, Undone } otherwise = Otherwise::InForce;
};

/// Of each file the newest text is written, however many were asked for meanwhile: a slow disk stays one text behind.
/// Event loop thread only; the disk is waited for on a thread of its own.
class KeptFiles {
 public:
  /// Hears what became of a text, or of a newer one of this file that was written in its place; `mark`: the file then.
  /// Io: not on disk. Busy: too much waits.
  using Then = std::function<void(const Result<void>& kept, const FileMark& mark)>;

  /// `loop` must outlive this.
  explicit KeptFiles(EventLoop& loop) : loop_(loop) {}

  /// Replaces the file by `text`, or removes it where `text` is empty.
  void Keep(const KeptFile& file, std::string text, Then then);
  /// What is not on disk of this file is given up.
  void Forget(const std::string& path);

  /// lensd ends: to be called again and again. What could not be written is tried again. True: all is on disk.
  bool Finish(Instant now);
  bool finishing() const { return finishing_; }
  /// What is not on disk, and why, as far as that is known.
  struct Missing {
    KeptFile file;
    std::string why;  ///< empty: the disk has not taken it yet
  };
  std::vector<Missing> missing() const;

  /// For what is read: it waits for what is written, and the other way round.
  TaskThread& thread() { return thread_; }

 private:
  struct Text {
    KeptFile file;
    std::string text;
    bool newer = false;      ///< than what is being written
    bool under_way = false;  ///< the thread has it
    bool forgotten = false;
    std::vector<Then> waiting;    ///< for the newer one
    std::vector<Then> answering;  ///< for the one that is under way
    std::string why;              ///< it is not on disk
  };
  void Begin(const std::string& path, Text& text);
  void Ended(const std::string& path, const Result<void>& kept, const FileMark& mark);

  EventLoop& loop_;
  std::map<std::string, Text> texts_;  ///< those that are not on disk
  Instant tried_{};
  bool finishing_ = false;
  TaskThread thread_;  // last: its tasks use the loop
};

}  // namespace lensd::daemon
