// Puts lensd together from its own parts, as daemon/main.cpp does: configuration, event loop, service, router, server.
// Not here: the command line, the journal, signals, udev. Told to end, it does what main() does at SIGTERM.
#include "life.h"

#include <utility>

#include "daemon/config/config.h"
#include "daemon/events/log.h"
#include "daemon/methods/lens_service.h"
#include "daemon/server/router.h"
#include "daemon/server/server.h"
#include "io/checked_file.h"
#include "loop/event_loop.h"
#include "machine.h"

namespace lensd::year {
namespace {

constexpr Duration kEndAtMost = std::chrono::seconds(60);

}  // namespace

struct Life::Parts {
  Lenses& lenses;
  std::string state;
  int listening;
  MonotonicClock clock{};
  daemon::EventLoop* loop = nullptr;
  daemon::LensService* service = nullptr;
  bool ended = false;

  daemon::ServedLens::Open OpenerOf(const daemon::LensConfig& lens) {
    return [this, name = lens.name]() -> Result<drivers::Device> { return lenses.Open(name); };
  }

  /// As Reload of main(), but that it reads in the event loop.
  void Reload(daemon::Router& router, const std::function<void(const Result<daemon::LensService::Replaced>&)>& then) {
    const auto config = daemon::ReadConfig("lensd.toml");
    if (!config) return then(PassOn(config));
    std::vector<daemon::FileMark> marks;
    for (const std::string& path : service->CalibrationFiles()) marks.push_back(daemon::MarkOf(path));
    const auto replaced =
        service->Replace(config->lenses, [this](const daemon::LensConfig& lens) { return OpenerOf(lens); }, marks);
    if (replaced) router.Restrict(daemon::Access(config->access));
    then(replaced);
  }

  void Run() {
    io::RemoveTemporaries(state);
    const auto config = daemon::ReadConfig("lensd.toml");
    if (!config) machine::Found("the configuration is refused: " + config.error().message);
    const auto made = *daemon::EventLoop::Create();
    daemon::LensService lens_service(*made, clock, state);
    loop = made.get();
    service = &lens_service;
    for (const daemon::LensConfig& lens : config->lenses) lens_service.AddLens(lens, OpenerOf(lens));
    daemon::Router router({"lensd", "lensd", "0", "https://lensd.io"});
    router.Restrict(daemon::Access(config->access));
    lens_service.OnReload([&](const auto& then) { Reload(router, then); });
    router.Add(lens_service);
    auto server = daemon::Server::Create(*made, listening, router, {}, "io.lensd.Lens.Busy", [](std::string_view) {});
    if (!server) machine::Found("no server: " + server.error().message);
    made->Supervise([&lens_service] { lens_service.LookAfter(); });
    lens_service.Begin();
    if (!made->Run()) machine::Found("the event loop failed");
    server->reset();
    loop = nullptr;
  }

  void Quit(Instant deadline) {
    const Instant now = MonotonicClock().Now();
    const auto ending = service->StillEnding();
    const bool on_disk = service->files().Finish(now);
    if (ending.empty() && (on_disk || now >= deadline)) return loop->Quit();
    if (now >= deadline) machine::Found("told to end, it does not: " + ending.front()->name());
    loop->After(std::chrono::milliseconds(2), [this, deadline] { Quit(deadline); });
  }
};

Life::Life(Lenses& lenses, const std::string& state, int listening)
    : parts_(new Parts{lenses, state, listening}), thread_([parts = parts_.get()] {
        parts->Run();
        parts->ended = true;
      }) {}

Life::~Life() {
  parts_->loop->Post([parts = parts_.get()] {
    const Duration parking = parts->service->End(daemon::ServedLens::Parks::First);
    parts->Quit(MonotonicClock().Now() + parking + kEndAtMost);
  });
  thread_.join();
}

bool Life::ended() const {
  return parts_->ended;
}

}  // namespace lensd::year
