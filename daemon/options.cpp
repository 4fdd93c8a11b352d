// lensd's command line.
#include "options.h"

#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "proto/interfaces.h"

namespace lensd::daemon {

std::variant<Options, int> ParseOptions(int argc, char** argv) {
  Options options;
  options.socket = proto::kDefaultSocket;
  std::string config;
  CLI::App app("lensd: serves motorised camera lenses over the Varlink interface io.lensd.Lens", "lensd");
  app.set_version_flag("--version", "lensd " LENSD_VERSION);
  app.add_option("--config", config, "configuration file; without it no lens is configured")->type_name("FILE");
  app.add_option("--socket", options.socket, "where to listen, unless systemd passes a socket")
      ->type_name("PATH")
      ->envname("LENSD_SOCKET")
      ->capture_default_str();
  app.add_option("--state", options.state,
                 "folder for remembered positions; without it, and without $STATE_DIRECTORY from systemd, they are\n"
                 "forgotten at the end")
      ->type_name("DIR");
  app.add_flag("--check-config", options.check_config, "read the configuration and what it names, then exit");
  app.add_flag("--devices", options.devices, "print what is plugged in as the reply of Devices, then exit");
  app.add_flag("--stop-motors", options.stop_motors,
               "stop every motor of the configured lenses, then exit: for after a lensd that was killed. Does nothing\n"
               "where systemd says in $SERVICE_RESULT that it ended well");
  app.footer(
      "Exit status: 0 after SIGTERM or SIGINT, else as in sysexits.h: 64 usage, 69 another lensd answers at the\n"
      "socket, 74 input or output, 78 configuration.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "lensd: %s; see lensd --help\n", error.what());
    return EX_USAGE;
  }
  if (!config.empty()) options.config = config;
  if (const char* folders = std::getenv("STATE_DIRECTORY"); options.state.empty() && folders != nullptr) {
    options.state = std::string(folders).substr(0, std::string_view(folders).find(':'));
  }
  return options;
}

}  // namespace lensd::daemon
