// Runs the command that a configuration gives for failures (`on_failure`).
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "base/clock.h"
#include "daemon/events/log.h"

namespace lensd::daemon {

/// One command at a time, on a thread of its own, in a process group of its own: all of that is ended with it, and
/// after 10 s at the latest. It reads the failure as one JSON object on stdin, what it writes goes where the log goes,
/// and no shell is between. A lens may have 10 in a minute, and 32 may wait: the others are dropped, counted, and told
/// of as `leftOut` of the next one.
class FailureCommands {
 public:
  /// Program and arguments, by lens.
  using Commands = std::map<std::string, std::vector<std::string>>;
  struct Counts {
    std::int64_t run = 0;
    std::int64_t failed = 0;
    std::int64_t dropped = 0;
  };

  /// The one of this process, which lives as long as that.
  static FailureCommands& Get();

  /// From now on, whatever waits already.
  void Configure(Commands commands);
  /// From any thread; never waits.
  void Tell(const Failure& failure);
  Counts counts();
  /// Gives what waits a second, and ends what runs then. Nothing is run from then on.
  void End();

 private:
  struct Job {
    std::vector<std::string> words;
    std::string lens, json;
  };
  /// What a lens has had of late.
  struct Rate {
    Instant since{};
    int taken = 0;
    std::int64_t left_out = 0;
  };
  FailureCommands();
  void Run();
  std::string Carry(const Job& job);
  std::string WaitFor(int process);

  std::mutex mutex_;
  std::condition_variable changed_;
  Commands commands_;  // guarded by mutex_, as all below
  std::map<std::string, Rate> rates_;
  std::deque<Job> waiting_;
  Counts counts_;
  bool running_ = false;
  enum class Until { Told, Quiet, Now } ends_ = Until::Told;
  std::thread thread_;
};

}  // namespace lensd::daemon
