// One thread a lens, since a device that hangs must not keep the others' motors running.
#include "daemon/stop_motors.h"

#include <chrono>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "base/guarded.h"
#include "daemon/events/log.h"
#include "daemon/methods/lenses.h"
#include "daemon/methods/open_driver.h"

namespace lensd::daemon {
namespace {

constexpr auto kAtMost = std::chrono::seconds(2);

Result<void> StopLens(const LensConfig& config, const Clock& clock) {
  auto device = OpenDriver(config.device, clock);
  if (!device) return PassOn(device);
  if (!device->lens) return {};
  Result<void> stopped;
  for (const drivers::Axis axis : drivers::kAxes) {
    const auto& can = device->lens->capabilities().axes[axis];
    if (!can || !can->can_stop) continue;
    if (auto here = device->lens->Stop(axis); !here) stopped = std::move(here);
  }
  return stopped;
}

/// What the threads have told so far.
struct Told {
  std::mutex mutex;
  std::condition_variable changed;
  std::map<std::string, Result<void>> by_lens;
};

}  // namespace

int StopMotors(const Config& config, const Clock& clock) {
  const auto told = std::make_shared<Told>();
  for (const LensConfig& lens : config.lenses) {
    std::thread([told, &lens, &clock] {
      Result<void> stopped;
      if (auto thrown = Guarded("stopping", [&] { stopped = StopLens(lens, clock); })) {
        stopped = PassOn(*std::move(thrown));
      }
      const std::lock_guard lock(told->mutex);
      told->by_lens.emplace(lens.name, std::move(stopped));
      told->changed.notify_all();
    }).detach();
  }
  std::unique_lock lock(told->mutex);
  told->changed.wait_for(lock, kAtMost, [&] { return told->by_lens.size() == config.lenses.size(); });
  int failed = 0;
  for (const LensConfig& lens : config.lenses) {
    const auto found = told->by_lens.find(lens.name);
    if (found != told->by_lens.end() && found->second) continue;
    ++failed;
    const std::string why = found == told->by_lens.end() ? "its device does not answer" : found->second.error().message;
    Log(Severity::Warning, Event::MotorsNotStopped, "its motors may still run: " + why, lens.name);
  }
  return failed;
}

}  // namespace lensd::daemon
