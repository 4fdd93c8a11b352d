// How far a long command has come, for the person who waits at a terminal.
#pragma once

#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "cli/terminal/session.h"
#include "varlink/json.h"

namespace lensd::cli {

/// One line on stderr that rewrites itself; gone when this ends. Only on a terminal, and not with --json. One thread.
class ProgressLine {
 public:
  explicit ProgressLine(const Session& session);
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;
  void Show(const std::string& text);
  void Clear();
  bool on() const { return on_; }

 private:
  bool on_;
  bool shown_ = false;
};

/// What a lens does, in such a line, from the second second of this object's life on, by a connection of its own.
class ActivityLine {
 public:
  /// `lens`: null where it was left out.
  ActivityLine(const Session& session, varlink::Json lens);
  ~ActivityLine();
  ActivityLine(const ActivityLine&) = delete;
  ActivityLine& operator=(const ActivityLine&) = delete;

 private:
  void Run();
  bool Quiet();

  const std::string socket_;
  const varlink::Json lens_;
  ProgressLine line_;
  int stop_ = -1;  ///< an eventfd that ends the wait for a state
  std::mutex mutex_;
  std::condition_variable changed_;
  bool ended_ = false;
  std::thread thread_;  ///< none where the line is off
};

}  // namespace lensd::cli
