// lensd: reads its configuration, opens the lenses, and serves them until it is told to stop.
#include <signal.h>
#include <sysexits.h>

#include <systemd/sd-daemon.h>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <system_error>

#include "config.h"
#include "drivers/hotplug/monitor.h"
#include "event_loop.h"
#include "lens_service.h"
#include "lenses.h"
#include "listener.h"
#include "log.h"
#include "options.h"
#include "router.h"
#include "server.h"

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

int CheckConfig(const Config& config, const Clock& clock) {
  for (const LensConfig& lens : config.lenses) {
    const auto device = OpenDevice(lens, clock);
    if (device) continue;
    if (!MayComeYet(device.error().code)) return Explain(device.error());
    Log(Severity::Warning, Event::LensLost, device.error().message + " (lensd would wait for it)");
  }
  return EX_OK;
}

/// The folder may be missing, not the one it is in.
Result<void> MakeStateFolder(const std::string& folder) {
  std::error_code error;
  if (folder.empty() || std::filesystem::is_directory(folder, error)) return {};
  std::filesystem::create_directory(folder, error);
  if (error) return Fail(Code::Io, "the state folder " + folder + " cannot be made: " + error.message());
  return {};
}

int Serve(const Options& options, const Config& config, const Clock& clock) {
  auto loop = EventLoop::Create();
  if (!loop) return Explain(loop.error());
  if (auto watched = (*loop)->QuitOnSignals(); !watched) return Explain(watched.error());
  auto listener = Listener::Open(options.socket);
  if (!listener) return Explain(listener.error());
  if (auto made = MakeStateFolder(options.state); !made) return Explain(made.error());
  LensService service(**loop, clock, options.state);
  if (auto opened = OpenLenses(config, clock, service); !opened) return Explain(opened.error());
  const auto monitor = drivers::hotplug::Monitor::Create((*loop)->get(), [&service] { service.plug_signal().Raise(); });
  if (!monitor) Log(Severity::Warning, Event::Started, monitor.error().message + "; looking now and then instead");
  Router router({"lensd", "lensd", LENSD_VERSION, "https://lensd.io"});
  router.Add(service);
  auto server = Server::Create(**loop, listener->descriptor(), router, Limits{}, "io.lensd.Lens.Busy",
                               [](std::string_view notice) { Log(Severity::Warning, Event::ClientDropped, notice); });
  if (!server) return Explain(server.error());
  (*loop)->ServeWatchdog();
  Log(Severity::Info, Event::Started, "serving " + std::to_string(config.lenses.size()) + " lenses");
  sd_notify(0, "READY=1");
  const auto ended = (*loop)->Run();
  sd_notify(0, "STOPPING=1");
  Log(Severity::Info, Event::Stopping, "stopping");
  return ended ? EX_OK : Explain(ended.error());
}

int Main(int argc, char** argv) {
  const auto options = ParseOptions(argc, argv);
  if (const int* status = std::get_if<int>(&options)) return *status;
  sigset_t blocked;
  sigemptyset(&blocked);
  sigaddset(&blocked, SIGTERM);
  sigaddset(&blocked, SIGINT);
  sigprocmask(SIG_BLOCK, &blocked, nullptr);  // before any thread: they inherit it
  OpenLog();
  const MonotonicClock clock;
  const auto config = ConfigOf(std::get<Options>(options));
  if (!config) return Explain(config.error());
  if (std::get<Options>(options).check_config) return CheckConfig(*config, clock);
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
