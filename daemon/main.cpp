// lensd: reads its configuration, opens the lenses, and serves them until it is told to stop.
#include <malloc.h>
#include <signal.h>
#include <sysexits.h>
#include <unistd.h>

#include <systemd/sd-daemon.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "daemon/config/config.h"
#include "daemon/config/drivers_table.h"
#include "daemon/config/unit_drop_in.h"
#include "daemon/config_check.h"
#include "daemon/events/failure_commands.h"
#include "daemon/events/log.h"
#include "daemon/methods/device_search.h"
#include "daemon/methods/lens_service.h"
#include "daemon/methods/lenses.h"
#include "daemon/methods/simulator_service.h"
#include "daemon/options.h"
#include "daemon/server/router.h"
#include "daemon/server/server.h"
#include "daemon/stop_motors.h"
#include "drivers/hotplug/monitor.h"
#include "io/checked_file.h"
#include "loop/event_loop.h"
#include "loop/listener.h"

namespace lensd::daemon {
namespace {

int StatusOf(Code code) {
  switch (code) {
    case Code::BadData:
    case Code::InvalidArgument:
    case Code::OutOfRange:
    case Code::Unsupported:
      return EX_CONFIG;
    case Code::Busy:
    case Code::Disconnected:
    case Code::WrongDevice:
    case Code::Timeout:
      return EX_UNAVAILABLE;
    case Code::Io:
      return EX_IOERR;
    case Code::Protocol:
      return EX_PROTOCOL;
    default:
      return EX_SOFTWARE;
  }
}

int Explain(const Error& error) {
  Log(Severity::Error, Event::Stopping, error.message);
  return StatusOf(error.code);
}

Result<Config> ConfigOf(const Options& options) {
  if (!options.config) return Config{};
  auto config = ReadConfig(*options.config);
  // A configuration that cannot be read is as wrong as one that makes no sense.
  if (!config && config.error().code == Code::Io) return Fail(Code::BadData, config.error().message);
  return config;
}

constexpr const char* kUsualState = "/var/lib/lensd";  ///< of the service

int CheckConfig(const Options& options, const Clock& clock) {
  if (options.config) {
    // A person who checks a file means the service, which has its folder there.
    std::error_code none;
    const bool usual = options.state.empty() && std::filesystem::exists(kUsualState, none);
    return CheckConfiguration(*options.config, usual ? kUsualState : options.state, clock);
  }
  std::fputs("lensd: --check-config needs a file to check: lensd --check-config --config /etc/lensd/lensd.toml\n",
             stderr);
  return EX_USAGE;
}

/// The folder may be missing, not the one it is in.
Result<void> MakeStateFolder(const std::string& folder) {
  std::error_code error;
  if (folder.empty() || std::filesystem::is_directory(folder, error)) return {};
  std::filesystem::create_directory(folder, error);
  if (error) return Fail(Code::Io, "the state folder " + folder + " cannot be made: " + error.message());
  return {};
}

/// Longer than a worker waits for its lens to stand still (worker.cpp).
constexpr Duration kDeviceAtMost = std::chrono::milliseconds(3000);

/// How long the end may take at most.
struct Ends {
  Instant devices;  ///< lenses to come to their end
  Instant disks;    ///< what is kept of them to be on disk
};

/// Ends the loop once every lens has come to its end and what is kept of them is on disk, or that takes too long.
void QuitInOrder(EventLoop& loop, LensService& service, Ends ends) {
  constexpr Duration kPause = std::chrono::milliseconds(2);
  const Instant now = MonotonicClock().Now();
  const auto ending = service.StillEnding();
  const auto at_disk = [](const ServedLens* lens) { return lens->left() == ServedLens::Left::Disk; };
  // A device has its time anew after each write: a lens comes to rest between two of them.
  if (std::ranges::any_of(ending, at_disk)) ends.devices = std::max(ends.devices, now + kDeviceAtMost);
  const bool left = ending.empty() || now >= ends.devices;
  const bool on_disk = service.files().Finish(now);
  // The thread that has just answered the last task may not have said yet that it is done.
  const bool files_rest = !service.files().thread().busy() || now >= ends.devices;
  if ((left && on_disk && files_rest) || now >= ends.disks) return loop.Quit();
  loop.After(kPause, [&loop, &service, ends] { QuitInOrder(loop, service, ends); });
}

/// What is lost, by name, once nothing waits for it any more.
void TellLost(LensService& service) {
  for (const ServedLens* lens : service.StillEnding()) {
    if (lens->left() == ServedLens::Left::Disk) {
      Log(Severity::Error, Event::StateNotKept, "its positions are not on disk: lensd ends before the disk took them",
          lens->name());
    } else {
      Log(Severity::Warning, Event::Stopping, "its device does not answer: it is left as it is", lens->name());
    }
  }
  for (const KeptFiles::Missing& lost : service.files().missing()) {
    Log(Severity::Error, Event::StateNotKept,
        lost.file.what + " (" + lost.file.path + "): not on disk as lensd ends, " +
            (lost.why.empty() ? "the disk has not taken it yet" : "which failed: " + lost.why),
        lost.file.lens);
  }
}

std::string Listed(std::string_view what, const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "; " + std::string(what) + " " : ", ") + name;
  return text;
}

void TellReloaded(const Result<LensService::Replaced>& replaced) {
  if (!replaced) {
    return Log(Severity::Error, Event::Reloaded,
               "the configuration was read again and not taken, all stays as it is: " + replaced.error().message);
  }
  Log(Severity::Info, Event::Reloaded,
      "the configuration was read again" + Listed("added", replaced->added) + Listed("removed", replaced->removed) +
          Listed("reopened", replaced->reopened) + Listed("unchanged", replaced->unchanged) +
          Listed("files that changed:", replaced->changed_files));
}

void Restrict(Router& router, const AccessConfig& config) {
  Access access(config);
  for (const std::string& group : access.unknown()) {
    Log(Severity::Info, Event::Started,
        "this machine has no group " + group + ": [access] gives its role to nobody else");
  }
  router.Restrict(std::move(access));
}

FailureCommands::Commands CommandsOf(const Config& config) {
  FailureCommands::Commands commands;
  for (const LensConfig& lens : config.lenses) {
    if (!lens.on_failure.empty()) commands.emplace(lens.name, lens.on_failure);
  }
  return commands;
}

/// Reads the configuration on the thread for files, and takes it if all of it makes sense.
void OfferReload(EventLoop& loop, LensService& service, Router& router, const std::string& file, const Clock& clock) {
  service.OnReload(
      [&loop, &service, &router, file, &clock](const std::function<void(const Result<LensService::Replaced>&)>& then) {
        const auto taken = service.files().thread().Submit(
            [&loop, &service, &router, file, &clock, then, paths = service.CalibrationFiles()] {
              auto config = ReadConfig(file);
              std::vector<FileMark> marks;
              for (const std::string& path : paths) marks.push_back(MarkOf(path));
              if (auto checked = config ? CheckAll(*config) : PassOn(config); !checked) config = PassOn(checked);
              loop.Post([&service, &router, config = std::move(config), marks = std::move(marks), &clock, then] {
                const auto opener = [&](const LensConfig& lens) { return OpenerOf(lens, clock, service); };
                const auto replaced = config ? service.Replace(config->lenses, opener, marks) : PassOn(config);
                if (replaced) Restrict(router, config->access);
                if (replaced) FailureCommands::Get().Configure(CommandsOf(*config));
                TellReloaded(replaced);
                then(replaced);
              });
            });
        if (!taken) then(Fail(Code::Busy, "too much waits to be read or written; try again"));
      });
}

Result<void> WatchSignals(EventLoop& loop, LensService& service) {
  // TimeoutStopSec= of the units is 15 s, and the commands of on_failure have one second after this.
  static constexpr Duration kDiskAtMost = std::chrono::seconds(13);  // static: the handler outlives this call
  auto watched = loop.OnSignals({SIGTERM, SIGINT}, [&, stopping = false](int) mutable {
    if (std::exchange(stopping, true)) {
      Log(Severity::Info, Event::Stopping, "second request to end: axes that are still parking stop where they are");
      service.End(ServedLens::Parks::No);
      return;
    }
    sd_notify(0, "STOPPING=1");
    Log(Severity::Info, Event::Stopping, "stopping");
    const Duration parking = service.End(ServedLens::Parks::First);
    const Instant now = MonotonicClock().Now();
    QuitInOrder(loop, service, {.devices = now + parking + kDeviceAtMost, .disks = now + kDiskAtMost});
  });
  if (!watched) return watched;
  return loop.OnSignals({SIGHUP}, [&service](int) {
    if (!service.reload()) return Log(Severity::Warning, Event::Reloaded, "there is no configuration to read again");
    service.reload()([](const auto&) {});
  });
}

int Serve(const Options& options, const Config& config, const Clock& clock) {
  auto loop = EventLoop::Create();
  if (!loop) return Explain(loop.error());
  auto listener = Listener::Open(options.socket);
  if (!listener) return Explain(listener.error());
  if (auto made = MakeStateFolder(options.state); !made) return Explain(made.error());
  if (!options.state.empty()) io::RemoveTemporaries(options.state);
  FailureCommands::Get().Configure(CommandsOf(config));
  OnFailure([](const Failure& failure) { FailureCommands::Get().Tell(failure); });
  LensService service(**loop, clock, options.state);
  if (auto added = AddLenses(config, clock, service); !added) return Explain(added.error());
  Router router({"lensd", "lensd", LENSD_VERSION, "https://lensd.io"});
  Restrict(router, config.access);
  if (options.config) OfferReload(**loop, service, router, *options.config, clock);
  if (auto watched = WatchSignals(**loop, service); !watched) return Explain(watched.error());
  const auto monitor = drivers::hotplug::Monitor::Create((*loop)->get(), [&service] { service.plug_signal().Raise(); });
  if (!monitor) Log(Severity::Warning, Event::Started, monitor.error().message + "; looking now and then instead");
  router.Add(service);
  SimulatorService simulator(service);
  router.Add(simulator);
  auto server = Server::Create(**loop, listener->descriptor(), router, Limits{}, "io.lensd.Lens.Busy",
                               [](std::string_view notice) { Log(Severity::Warning, Event::ClientDropped, notice); });
  if (!server) return Explain(server.error());
  (*loop)->Supervise([&service] { service.LookAfter(); });
  Log(Severity::Info, Event::Started, "serving " + std::to_string(config.lenses.size()) + " lenses");
  sd_notify(0, "READY=1");
  service.Begin();
  const auto ended = (*loop)->Run();
  const int status = ended ? EX_OK : Explain(ended.error());
  if (!ended) return status;
  TellLost(service);
  FailureCommands::Get().End();
  if (service.StillEnding().empty() && !service.files().thread().busy()) return status;
  // Threads that hang in a driver or at a disk cannot be waited for.
  listener->Remove();
  FlushLog();
  _exit(status);
}

/// Threads that hang in a driver cannot be waited for.
[[noreturn]] void StopMotorsAndExit(const Config& config, const Clock& clock) {
  const char* result = std::getenv("SERVICE_RESULT");
  const bool ended_well = result != nullptr && std::string_view(result) == "success";
  const int failed = ended_well ? 0 : StopMotors(config, clock);
  FlushLog();
  _exit(failed == 0 ? EX_OK : EX_UNAVAILABLE);
}

int PrintDevices() {
  const auto unconfigured = [](std::string_view, std::string_view) { return std::nullopt; };
  const std::string reply = DevicesReply(SearchDevices(), unconfigured) + "\n";
  const bool written = std::fputs(reply.c_str(), stdout) >= 0 && std::fflush(stdout) == 0;
  return written ? EX_OK : EX_IOERR;
}

int PrintUnitDropIn(const Config& config, const Options& options) {
  const std::string text = UnitDropIn(config, options.config.value_or("no configuration"));
  const bool written = std::fputs(text.c_str(), stdout) >= 0 && std::fflush(stdout) == 0;
  return written ? EX_OK : EX_IOERR;
}

/// By default glibc gives threads heaps of their own, eight for each processor, and each keeps what it once needed:
/// with four lenses on two processors that was 5.4 MiB of free memory, where one heap held 2.3. With two, stops and
/// snapshots take as long as with sixteen. Before any thread begins.
void ShareHeaps() {
  constexpr int kHeaps = 2;
  mallopt(M_ARENA_MAX, kHeaps);
}

int Main(int argc, char** argv) {
  if (const auto status = BeginDrivers({argv, static_cast<std::size_t>(argc)})) return *status;
  const auto options = ParseOptions(argc, argv);
  if (const int* status = std::get_if<int>(&options)) return *status;
  ShareHeaps();
  sigset_t blocked;
  sigemptyset(&blocked);
  sigaddset(&blocked, SIGTERM);
  sigaddset(&blocked, SIGINT);
  sigaddset(&blocked, SIGHUP);
  sigprocmask(SIG_BLOCK, &blocked, nullptr);  // before any thread: they inherit it
  // SIGIO comes where a client opens a frame while lensd asks whether it was given back (FrameLoans).
  for (const int harmless : {SIGPIPE, SIGUSR1, SIGUSR2, SIGIO}) signal(harmless, SIG_IGN);
  if (const auto& file = std::get<Options>(options).config) NameConfiguration(*file);
  if (std::get<Options>(options).devices) return PrintDevices();
  const MonotonicClock clock;
  if (std::get<Options>(options).check_config) return CheckConfig(std::get<Options>(options), clock);
  OpenLog();
  const auto config = ConfigOf(std::get<Options>(options));
  if (!config) return Explain(config.error());
  if (std::get<Options>(options).unit_drop_in) return PrintUnitDropIn(*config, std::get<Options>(options));
  if (std::get<Options>(options).stop_motors) StopMotorsAndExit(*config, clock);
  return Serve(std::get<Options>(options), *config, clock);
}

}  // namespace
}  // namespace lensd::daemon

int main(int argc, char** argv) {
  try {
    return lensd::daemon::Main(argc, argv);
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "lensd: internal error: %s\n", failure.what());
    return EX_SOFTWARE;
  }
}
