// The process runs the same program anew: after fork() alone a process of several threads may hang in any lock.
#include "trial.h"

#include <arv.h>
#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>
#include <utility>

#include "camera_search.h"
#include "drivers/aravis/driver.h"
#include "gobject_handles.h"

namespace lensd::drivers::aravis {
namespace {

constexpr Duration kTrialLimit = std::chrono::seconds(4);  ///< a camera's file is read in less than one
constexpr unsigned kChildLimit_s = 10;                     ///< where the process that waits for it is gone
constexpr Duration kLook = std::chrono::milliseconds(2);

/// Written before any thread begins.
std::string& Program() {
  static std::string program;
  return program;
}

/// An errno; 0: it runs.
int Spawn(const std::vector<std::string>& command, pid_t& child) {
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));  // only read there
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawnattr_t how;
  posix_spawn_file_actions_init(&files);
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    posix_spawn_file_actions_addopen(&files, descriptor, "/dev/null", O_RDWR, 0);
  }
  posix_spawn_file_actions_addclosefrom_np(&files, STDERR_FILENO + 1);
  posix_spawnattr_init(&how);
  sigset_t signals;
  sigfillset(&signals);
  posix_spawnattr_setsigdefault(&how, &signals);
  sigemptyset(&signals);
  posix_spawnattr_setsigmask(&how, &signals);
  posix_spawnattr_setflags(&how, POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSIGMASK);
  const int error = posix_spawn(&child, command.front().c_str(), &files, &how, arguments.data(), environ);
  posix_spawnattr_destroy(&how);
  posix_spawn_file_actions_destroy(&files);
  return error;
}

std::unexpected<Error> Ended(const std::string& how) {
  return Fail(Code::Unsupported, how);
}

}  // namespace

Result<void> RunTrial(const std::vector<std::string>& command, Duration limit) {
  pid_t child = 0;
  if (const int error = Spawn(command, child); error != 0) {
    return Fail(Code::Io, command.front() + " cannot be started: " + std::strerror(error));
  }
  const Instant deadline = std::chrono::steady_clock::now() + limit;
  int status = 0;
  while (waitpid(child, &status, WNOHANG) == 0) {
    if (std::chrono::steady_clock::now() >= deadline) {
      kill(child, SIGKILL);
      while (waitpid(child, nullptr, 0) < 0 && errno == EINTR) continue;
      return Ended("did not end within " + std::to_string(std::chrono::ceil<std::chrono::milliseconds>(limit).count()) +
                   " ms");
    }
    std::this_thread::sleep_for(kLook);
  }
  if (WIFSIGNALED(status)) return Ended(std::string("crashed (") + strsignal(WTERMSIG(status)) + ")");
  if (WEXITSTATUS(status) != 0) return Ended("failed with status " + std::to_string(WEXITSTATUS(status)));
  return {};
}

Result<void> TryUsbCameraFirst(const std::string& id) {
  if (Program().empty()) return {};
  return RunTrial({Program(), kTryUsbCamera, id}, kTrialLimit);
}

void TryUsbCamerasBy(std::string program) {
  Program() = std::move(program);
}

int TryUsbCamera(const std::string& id) {
  alarm(kChildLimit_s);
  TameGlib();
  arv_disable_interface("GigEVision");  // whose search takes a second
  // What goes wrong in order is seen once more, and reported, by the process that waits for this one.
  (void)OpenListed(
      {.id = id, .physical_id = "", .protocol = "USB3Vision", .address = "", .vendor = "", .model = "", .serial = ""});
  return 0;
}

}  // namespace lensd::drivers::aravis
