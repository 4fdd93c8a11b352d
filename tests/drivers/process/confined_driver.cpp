// A driver that tries what a driver must not do, once it is confined, and says what it was answered: as doubts about
// its device, "WHAT: ANSWER".
#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

#include "drivers/host/host.h"

namespace lensd::testing {
namespace {

class Probe {
 public:
  explicit Probe(drivers::Findings& findings) : findings_(findings) {}
  void Say(const std::string& what, bool done) {
    findings_.Doubt(what + ": " + (done ? "done" : strerrorname_np(errno)));
  }

 private:
  drivers::Findings& findings_;
};

void TrySockets(Probe& probe) {
  for (int family = 0; family < AF_MAX; ++family) {
    errno = 0;
    const int made = socket(family, SOCK_DGRAM, 0);
    probe.Say("socket " + std::to_string(family), made >= 0);
    if (made >= 0) close(made);
  }
}

void TryFile(Probe& probe, const std::string& path, int how, const std::string& word) {
  const int opened = open(path.c_str(), how | O_CLOEXEC | O_NOCTTY | O_NONBLOCK, 0600);
  probe.Say(word + " " + path, opened >= 0);
  if (opened >= 0) close(opened);
}

void TryOthers(Probe& probe, const char* program) {
  void* room =
      mmap(nullptr, std::size_t{2} << 30, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  probe.Say("2 GiB", room != MAP_FAILED);
  if (room != MAP_FAILED) munmap(room, std::size_t{2} << 30);
  probe.Say("kill the parent", kill(getppid(), 0) == 0);
  probe.Say("kill itself", kill(getpid(), 0) == 0);
  const bool traced = ptrace(PTRACE_SEIZE, getppid(), nullptr, nullptr) == 0;
  probe.Say("ptrace the parent", traced);
  char* const words[] = {const_cast<char*>(program), nullptr};
  execve(program, words, environ);
  probe.Say("execve", false);
}

Result<drivers::Device> OpenProbe(const Settings& settings, const Clock& clock) {
  SettingsReader read(settings, "the probe");
  const std::string allowed = read.RequiredText("allowed"), other = read.RequiredText("other"),
                    file = read.RequiredText("file");
  if (auto done = read.Finish(); !done) return PassOn(done);
  drivers::Device device;
  device.lens = drivers::LensWithoutAxes({.driver = "probe", .model = "Probe", .serial = "", .axes = {}}, clock);
  Probe probe(device.findings);
  TrySockets(probe);
  for (const std::string& path : {allowed, other}) {
    TryFile(probe, path, O_RDONLY, "read");
    TryFile(probe, path, O_RDWR, "write");
  }
  TryFile(probe, file, O_RDONLY, "read");
  TryFile(probe, file, O_RDWR, "write");
  TryFile(probe, file + ".new", O_WRONLY | O_CREAT, "write");
  TryFile(probe, "/dev/null", O_RDWR, "write");
  TryOthers(probe, "/bin/true");
  return device;
}

}  // namespace
}  // namespace lensd::testing

/// confined-driver none|network PATH...
int main(int count, char** words) {
  if (count < 2) return 64;
  lensd::drivers::host::RunHost(
      {.name = "probe", .open = lensd::testing::OpenProbe},
      {.network = std::strcmp(words[1], "network") == 0, .paths = {words + 2, words + count}});
}
