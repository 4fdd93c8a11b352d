// A command gets its event from a file in memory: nothing here ever waits for it to read.
#include "daemon/events/failure_commands.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <string_view>
#include <utility>

#include "loop/descriptor.h"
#include "varlink/json.h"

namespace lensd::daemon {
namespace {

using namespace std::chrono_literals;

constexpr auto kCommandAtMost = 10s;
constexpr auto kLook = 20ms;  // between looks whether it has ended
constexpr auto kQuietAtMost = 1s;
constexpr std::size_t kMostJobs = 32;
constexpr int kMostInAMinute = 10;

std::string Utc() {
  const auto now = std::chrono::system_clock::now();
  const std::time_t seconds = std::chrono::system_clock::to_time_t(now);
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch()).count() % 1000;
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  char day[32];
  char text[48];
  std::strftime(day, sizeof day, "%Y-%m-%dT%H:%M:%S", &utc);
  std::snprintf(text, sizeof text, "%s.%03dZ", day, static_cast<int>(ms));
  return text;
}

varlink::Json OrNull(const std::string& text) {
  return text.empty() ? varlink::Json(nullptr) : varlink::Json(text);
}

std::string EventText(const Failure& failure, Instant now, std::int64_t left_out) {
  return varlink::WriteJson({{"version", 1},
                             {"lens", failure.lens},
                             {"axis", OrNull(failure.axis)},
                             {"event", EventName(failure.event)},
                             {"severity", failure.severity == Severity::Error ? "error" : "warning"},
                             {"message", failure.message},
                             {"time", Utc()},
                             {"atNs", now.time_since_epoch().count()},
                             {"leftOut", left_out}}) +
         "\n";
}

/// To be read from its beginning; empty where the kernel gives none.
Descriptor FileWith(std::string_view text) {
  Descriptor file(memfd_create("lensd-failure", MFD_CLOEXEC));
  if (file.get() < 0) return file;
  const bool written = write(file.get(), text.data(), text.size()) == static_cast<ssize_t>(text.size());
  if (!written || lseek(file.get(), 0, SEEK_SET) != 0) return Descriptor();
  return file;
}

/// What systemd told lensd alone is not for others.
std::vector<char*> Environment() {
  constexpr std::array<std::string_view, 3> kOurs = {"NOTIFY_SOCKET=", "WATCHDOG_", "LISTEN_"};
  std::vector<char*> kept;
  for (char** each = environ; *each != nullptr; ++each) {
    const std::string_view text(*each);
    if (std::ranges::none_of(kOurs, [&](std::string_view ours) { return text.starts_with(ours); }))
      kept.push_back(*each);
  }
  kept.push_back(nullptr);
  return kept;
}

/// An errno; 0: it runs, as `process`.
int Spawn(const std::vector<std::string>& words, int input, pid_t& process) {
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));  // only read there
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawnattr_t how;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, input, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&files, STDERR_FILENO, STDOUT_FILENO);
  posix_spawn_file_actions_addclosefrom_np(&files, STDERR_FILENO + 1);
  posix_spawnattr_init(&how);
  sigset_t signals;
  sigfillset(&signals);
  posix_spawnattr_setsigdefault(&how, &signals);
  sigemptyset(&signals);
  posix_spawnattr_setsigmask(&how, &signals);
  posix_spawnattr_setpgroup(&how, 0);
  posix_spawnattr_setflags(&how, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSIGMASK);
  const int error = posix_spawn(&process, words.front().c_str(), &files, &how, arguments.data(), Environment().data());
  posix_spawnattr_destroy(&how);
  posix_spawn_file_actions_destroy(&files);
  return error;
}

bool HasEnded(pid_t process) {
  siginfo_t found{};
  return waitid(P_PID, static_cast<id_t>(process), &found, WEXITED | WNOHANG | WNOWAIT) != 0 || found.si_pid == process;
}

}  // namespace

FailureCommands& FailureCommands::Get() {
  static auto* const only = new FailureCommands;
  return *only;
}

FailureCommands::FailureCommands() : thread_([this] { Run(); }) {}

void FailureCommands::Configure(Commands commands) {
  const std::lock_guard lock(mutex_);
  commands_ = std::move(commands);
  std::erase_if(rates_, [this](const auto& rate) { return !commands_.contains(rate.first); });
}

void FailureCommands::Tell(const Failure& failure) {
  const std::lock_guard lock(mutex_);
  const auto command = commands_.find(failure.lens);
  if (command == commands_.end() || command->second.empty() || ends_ != Until::Told) return;
  const Instant now = MonotonicClock().Now();
  Rate& rate = rates_[failure.lens];
  if (rate.taken == 0 || now - rate.since > std::chrono::minutes(1)) {
    rate.since = now;
    rate.taken = 0;
  }
  if (rate.taken >= kMostInAMinute || waiting_.size() >= kMostJobs) {
    ++rate.left_out;
    ++counts_.dropped;
    return;
  }
  ++rate.taken;
  waiting_.push_back({command->second, failure.lens, EventText(failure, now, std::exchange(rate.left_out, 0))});
  changed_.notify_all();
}

FailureCommands::Counts FailureCommands::counts() {
  const std::lock_guard lock(mutex_);
  return counts_;
}

void FailureCommands::End() {
  std::unique_lock lock(mutex_);
  if (!thread_.joinable()) return;
  ends_ = Until::Quiet;
  changed_.notify_all();
  changed_.wait_for(lock, kQuietAtMost, [this] { return waiting_.empty() && !running_; });
  ends_ = Until::Now;
  changed_.notify_all();
  lock.unlock();
  thread_.join();
}

void FailureCommands::Run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return !waiting_.empty() || ends_ != Until::Told; });
    if (waiting_.empty() || ends_ == Until::Now) return;
    const Job job = std::move(waiting_.front());
    waiting_.pop_front();
    running_ = true;
    ++counts_.run;
    lock.unlock();
    const std::string wrong = Carry(job);
    // Without the lens as a field: that would be a failure to tell of.
    if (!wrong.empty()) {
      Log(Severity::Warning, Event::FailureNotTold,
          "on_failure of lens \"" + job.lens + "\": " + job.words.front() + " " + wrong);
    }
    lock.lock();
    running_ = false;
    if (!wrong.empty()) ++counts_.failed;
    changed_.notify_all();
  }
}

/// Empty: it was run, and ended well.
std::string FailureCommands::Carry(const Job& job) {
  const Descriptor input = FileWith(job.json);
  if (input.get() < 0) return std::string("cannot be given its event: ") + std::strerror(errno);
  pid_t process = 0;
  if (const int error = Spawn(job.words, input.get(), process); error != 0) {
    return std::string("cannot be run: ") + std::strerror(error);
  }
  return WaitFor(process);
}

/// Until it has ended or has to; its number is not free before all of its group is gone.
std::string FailureCommands::WaitFor(int process) {
  const Instant deadline = MonotonicClock().Now() + kCommandAtMost;
  bool ended = HasEnded(process);
  std::unique_lock lock(mutex_);
  while (!ended && MonotonicClock().Now() < deadline && ends_ != Until::Now) {
    changed_.wait_for(lock, kLook, [this] { return ends_ == Until::Now; });
    ended = HasEnded(process);
  }
  lock.unlock();
  kill(-process, SIGKILL);
  int status = 0;
  waitpid(process, &status, 0);
  if (!ended) return "took too long and was ended";
  if (WIFSIGNALED(status)) return "was ended by signal " + std::to_string(WTERMSIG(status));
  if (WEXITSTATUS(status) != 0) return "ended with status " + std::to_string(WEXITSTATUS(status));
  return "";
}

}  // namespace lensd::daemon
