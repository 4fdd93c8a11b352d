// lensd's command line.
#pragma once

#include <optional>
#include <string>
#include <variant>

namespace lensd::daemon {

struct Options {
  std::optional<std::string> config;  ///< as named, else the usual file where it is there, or drop-ins of it
  std::string socket;
  std::string state;  ///< folder for what outlives the daemon; empty: memory only
  bool check_config = false;
  bool devices = false;
  bool stop_motors = false;
  bool unit_drop_in = false;
};

/// The options, or the exit status where there is nothing more to do: help or version asked for (0), or a usage error
/// (64) already explained on stderr.
std::variant<Options, int> ParseOptions(int argc, char** argv);

}  // namespace lensd::daemon
