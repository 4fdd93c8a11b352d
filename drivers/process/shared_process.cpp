// While one device connects, another one that shares the process has not left it: so the process goes on listening.
#include "shared_process.h"

#include <map>
#include <string>
#include <utility>

namespace lensd::drivers::process {

std::shared_ptr<SharedProcess> SharedProcess::For(const Program& program) {
  if (program.shares.empty()) return std::make_shared<SharedProcess>();
  static std::mutex mutex;
  static std::map<std::string, std::shared_ptr<SharedProcess>> all;
  const std::lock_guard lock(mutex);
  std::shared_ptr<SharedProcess>& found = all[program.shares];
  if (!found) found = std::make_shared<SharedProcess>();
  return found;
}

Result<SharedProcess::Connected> SharedProcess::Connect(const Program& program) {
  const std::lock_guard lock(mutex_);
  Connected connected{process_.lock(), {}};
  if (!connected.process || !connected.process->running()) {
    auto started = HostProcess::Start(program);
    if (!started) return PassOn(started);
    process_ = connected.process = *std::move(started);
  }
  for (daemon::Descriptor& connection : connected.connections) {
    auto socket = connected.process->Connect();
    if (!socket && socket.error().code == Code::Disconnected) return PassOn(connected.process->HowItEnded("Open"));
    if (!socket) return PassOn(socket);
    connection = *std::move(socket);
  }
  return connected;
}

}  // namespace lensd::drivers::process
