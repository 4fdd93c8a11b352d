// What a lens-bench subcommand is, and how it reads its command line.
#pragma once

#include <functional>
#include <string_view>

namespace CLI {
class App;
}

namespace lensd::bench {

/// One row of the table in main.cpp. `run` gets the arguments after the subcommand's name, with argv[0] naming it
/// ("lens-bench render"), and returns the exit status: 0, 1 (the answer is no) or one of sysexits.h.
struct Command {
  std::string_view name;
  std::string_view help;  ///< one line
  int (*run)(int argc, char** argv);
};

/// Parses argv with `app`, then runs `body` and returns its status. Help goes to stdout (0), a usage error is one line
/// on stderr (EX_USAGE), an escaped exception another (EX_SOFTWARE).
int ParseThen(CLI::App& app, int argc, char** argv, const std::function<int()>& body);

}  // namespace lensd::bench
