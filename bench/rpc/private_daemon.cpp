// Starts lensd on a private socket and waits until it serves.
#include "bench/rpc/private_daemon.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "varlink/client.h"

namespace lensd::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr const char* kScene = R"(version = 1
[camera]
width = 64
height = 48
pixel_um = 3.45
[lens]
model = "thin"
focal_length_mm = 25.0
f_number = [1.4, 16.0]
extension_mm = [0.0, 1.6]
steps = 8192
[[surface]]
kind = "wall"
distance_m = 1.2
constant = 0.5
)";

}  // namespace

PrivateDaemon::PrivateDaemon() {
  std::string pattern = std::filesystem::temp_directory_path() / "lens-bench-XXXXXX";
  if (::mkdtemp(pattern.data()) != nullptr) folder_ = pattern;
}

PrivateDaemon::~PrivateDaemon() {
  if (process_ > 0 && ::kill(process_, SIGTERM) == 0) ::waitpid(process_, nullptr, 0);
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

void PrivateDaemon::WriteConfiguration(int lenses) const {
  std::ofstream(folder_ + "/scene.toml") << kScene;
  std::ofstream config(folder_ + "/lensd.toml");
  config << "version = 1\n";
  for (int i = 0; i < lenses; ++i) {
    config << "[[lens]]\nname = \"lens-" << i << "\"\ndriver = \"sim\"\nscene = \"scene.toml\"\n";
  }
}

/// Every lens is open.
bool PrivateDaemon::Ready() const {
  auto client = varlink::Client::Connect(socket());
  if (!client) return false;
  const auto status = client->Invoke("io.lensd.Lens.Status", varlink::Json::object());
  return status && status->error.empty() &&
         std::ranges::all_of(status->parameters["lenses"], [](const auto& lens) { return lens["connected"] == true; });
}

Result<std::unique_ptr<PrivateDaemon>> PrivateDaemon::Start(int lenses) {
  std::unique_ptr<PrivateDaemon> daemon(new PrivateDaemon);
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe");
  const std::string program = self.parent_path() / "lensd";
  daemon->WriteConfiguration(lenses);
  const std::string config = daemon->folder_ + "/lensd.toml", socket = daemon->socket();
  const char* arguments[] = {program.c_str(), "--config", config.c_str(), "--socket", socket.c_str(), nullptr};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  const int failed = ::posix_spawn(&daemon->process_, program.c_str(), &actions, nullptr,
                                   const_cast<char* const*>(arguments), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) return Fail(Code::Disconnected, "cannot start " + program + ", which belongs beside lens-bench");
  const auto deadline = Clock::now() + std::chrono::seconds(20);
  while (!daemon->Ready()) {
    if (Clock::now() > deadline || ::waitpid(daemon->process_, nullptr, WNOHANG) != 0) {
      return Fail(Code::Disconnected, program + " did not open its socket");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return daemon;
}

}  // namespace lensd::bench
