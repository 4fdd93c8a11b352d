// What the commands of lens-bench have in common: reading options, and running only if they are right.
#include "bench/command.h"

#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>

namespace lensd::bench {

int ParseThen(CLI::App& app, int argc, char** argv, const std::function<int()>& body) {
  app.name(argv[0]);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    std::cerr << argv[0] << ": " << error.what() << "\n";
    return EX_USAGE;
  }
  try {
    return body();
  } catch (const std::exception& error) {
    std::cerr << argv[0] << ": " << error.what() << "\n";
    return EX_SOFTWARE;
  }
}

}  // namespace lensd::bench
