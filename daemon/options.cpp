// lensd's command line.
#include "daemon/options.h"

#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "base/nearest_word.h"
#include "daemon/config/config.h"
#include "proto/interfaces.h"

namespace lensd::daemon {

namespace {

/// What is wrong with the command line, in words of our own where the parser's say little.
std::string Complaint(const CLI::App& app, const CLI::ParseError& error) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  const auto unknown = app.remaining();
  if (!unknown.empty()) {
    const std::string first = unknown.front().substr(0, unknown.front().find('='));
    const auto meant = first.starts_with("-") ? NearestWord(first, names) : std::nullopt;
    return (first.starts_with("-") ? "there is no option " + first : "'" + first + "' is no option") +
           (meant ? "; did you mean " + *meant + "?" : "");
  }
  const std::string said = error.what();
  const std::string option = said.substr(0, said.find(':'));
  const bool without = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ArgumentMismatch);
  return without && std::ranges::find(names, option) != names.end() ? option + " needs a value" : said;
}

}  // namespace

std::variant<Options, int> ParseOptions(int argc, char** argv) {
  Options options;
  options.socket = proto::kDefaultSocket;
  std::string config;
  CLI::App app("lensd: serves motorised camera lenses over the Varlink interface io.lensd.Lens", "lensd");
  app.set_version_flag("--version", "lensd " LENSD_VERSION);
  app.add_option(
         "--config", config,
         "configuration file; when left out, /etc/lensd/lensd.toml if it is there, or has drop-ins; else no lens\n"
         "is configured")
      ->type_name("FILE")
      ->envname("LENSD_CONFIG");
  app.add_option("--socket", options.socket, "where to listen, unless systemd passes a socket")
      ->type_name("PATH")
      ->envname("LENSD_SOCKET")
      ->capture_default_str();
  app.add_option("--state", options.state,
                 "folder for saved positions, calibrations and presets; without it, and without $STATE_DIRECTORY from "
                 "systemd,\n"
                 "they are lost when lensd ends")
      ->type_name("DIR");
  app.add_flag("--check-config", options.check_config,
               "check the configuration and the files it names, print every mistake, then exit");
  app.add_flag("--devices", options.devices, "print what is plugged in, as the reply of the method Devices, then exit");
  app.add_flag("--stop-motors", options.stop_motors,
               "stop every motor of the configured lenses, then exit. Run it after lensd was killed. It does nothing "
               "if systemd\n"
               "reports in $SERVICE_RESULT that lensd ended normally");
  app.add_flag("--print-unit-drop-in", options.unit_drop_in,
               "print a drop-in for lensd.service that allows only the devices that the configured drivers open, then\n"
               "exit");
  app.footer(
      "Exit status: 0 after SIGTERM or SIGINT, else as in sysexits.h: 64 usage, 69 another lensd answers at the\n"
      "socket, 74 input or output, 78 configuration.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "lensd: %s; for example: lensd --config /etc/lensd/lensd.toml; see lensd --help\n",
                 Complaint(app, error).c_str());
    return EX_USAGE;
  }
  if (!config.empty()) options.config = config;
  std::error_code none;
  const auto there = [&](const std::string& path) { return std::filesystem::exists(path, none); };
  if (!options.config && (there(kUsualConfig) || there(kUsualConfig + std::string(".d"))))
    options.config = kUsualConfig;
  if (const char* folders = std::getenv("STATE_DIRECTORY"); options.state.empty() && folders != nullptr) {
    options.state = std::string(folders).substr(0, std::string_view(folders).find(':'));
  }
  return options;
}

}  // namespace lensd::daemon
