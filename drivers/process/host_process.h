// A driver's process: started with a listening socket, listened to, ended and buried.
#pragma once

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include "base/result.h"
#include "drivers/process/process.h"
#include "loop/descriptor.h"

namespace lensd::drivers::process {

/// Lines that a process has printed: passed on, and the last ones kept. Any thread but for Take().
class PrintedLines {
 public:
  explicit PrintedLines(std::function<void(std::string_view)> log) : log_(std::move(log)) {}

  /// What was read next. One thread.
  void Take(std::string_view bytes, Instant now);
  /// No more comes.
  void End(Instant now);
  /// Waits a moment for the end; "; it printed last: ONE | TWO", or nothing where it printed nothing.
  std::string Last();

  static constexpr int kMostInASecond = 100;
  static constexpr std::size_t kKept = 10;
  static constexpr std::size_t kLongestLine = 400;  ///< bytes; the rest of a longer one is left out

 private:
  void Line(Instant now);
  void Pass(const std::string& line, Instant now);

  const std::function<void(std::string_view)> log_;
  std::string line_;  ///< that is being read
  Instant second_{};  ///< when the present one began
  int passed_ = 0;    ///< lines in it
  int left_out_ = 0;
  std::mutex mutex_;  // guards what follows
  std::condition_variable ended_changed_;
  std::deque<std::string> last_;
  bool ended_ = false;
};

/// Any thread.
class HostProcess {
 public:
  /// Disconnected: it cannot be started, with the reason.
  static Result<std::shared_ptr<HostProcess>> Start(const Program& program);
  /// Waits for its end, which the end of the connections brings, for 3 s; then it is killed.
  ~HostProcess();
  HostProcess(const HostProcess&) = delete;
  HostProcess& operator=(const HostProcess&) = delete;

  /// A further connection. Disconnected: the process listens no more. Busy: lensd has too many open files.
  Result<daemon::Descriptor> Connect() const;
  bool running() const;
  int process() const { return process_; }
  /// Ends it by SIGKILL.
  void Kill();
  /// It closed a connection during a call of `method`: waits for its end, and says how it ended, or why another lens of
  /// it ended it. Disconnected.
  Error HowItEnded(std::string_view method);
  /// Ends it by SIGKILL: `why`, or what was said first by another thread, and the last lines that it printed.
  /// Disconnected.
  Error EndBecause(const std::string& why);

 private:
  explicit HostProcess(const Program& program);
  Result<daemon::Descriptor> Listen();
  Result<void> Spawn(const Program& program, const daemon::Descriptor& listening);
  void ReadPrinted();
  bool WaitForEnd(Duration at_most) const;
  void Bury();

  std::string folder_;  ///< of the socket; of this user alone
  std::string path_;
  int process_ = -1;
  daemon::Descriptor handle_;  ///< a pidfd: readable once it has ended
  daemon::Descriptor output_;  ///< what it prints
  daemon::Descriptor enough_;  ///< readable once its output is read no more
  PrintedLines printed_;
  std::thread reader_;
  std::mutex mutex_;                  // guards the next two
  std::optional<std::string> ended_;  ///< "signal 11"; nothing: it was not buried yet
  std::string ended_because_;         ///< lensd killed it; empty: lensd did not
};

}  // namespace lensd::drivers::process
