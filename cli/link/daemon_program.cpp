// lensctl has no drivers of its own: what only they know, without a daemon, lensd's program is asked for.
#include "cli/link/daemon_program.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "base/clock.h"

namespace lensd::cli {
namespace {

constexpr Duration kProgramEnds = std::chrono::seconds(60);

std::string Program() {
  std::error_code ignored;
  const auto beside = std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path() / "lensd";
  return std::filesystem::exists(beside, ignored) ? beside.string() : "lensd";
}

/// Until the other end is closed. False: it was not in time.
bool ReadToTheEnd(int from, std::string& said) {
  const Instant end = MonotonicClock().Now() + kProgramEnds;
  std::array<char, 4096> buffer{};
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - MonotonicClock().Now()).count();
    pollfd waiting{.fd = from, .events = POLLIN, .revents = 0};
    if (left <= 0 || poll(&waiting, 1, static_cast<int>(left)) == 0) return false;
    const ssize_t count = read(from, buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return true;
    said.append(buffer.data(), static_cast<std::size_t>(count));
  }
}

}  // namespace

ProgramEnd RunDaemonProgram(std::vector<std::string> arguments, int stream) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return {-1, std::strerror(errno)};
  arguments.insert(arguments.begin(), Program());
  std::vector<char*> words;
  for (std::string& argument : arguments) words.push_back(argument.data());
  words.push_back(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    if (stream != STDOUT_FILENO) dup2(open("/dev/null", O_WRONLY | O_CLOEXEC), STDOUT_FILENO);  // ours is for answers
    dup2(ends[1], stream);
    execvp(words[0], words.data());
    _exit(127);
  }
  close(ends[1]);
  ProgramEnd end;
  const bool in_time = child > 0 && ReadToTheEnd(ends[0], end.said);
  close(ends[0]);
  if (child < 0) return end;
  if (!in_time) kill(child, SIGKILL);
  int status = 0;
  if (waitpid(child, &status, 0) == child && WIFEXITED(status)) end.status = WEXITSTATUS(status);
  while (!end.said.empty() && end.said.back() == '\n') end.said.pop_back();
  return end;
}

}  // namespace lensd::cli
