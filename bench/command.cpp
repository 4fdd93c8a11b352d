// What the commands of lens-bench have in common: reading options, and running only if they are right.
#include "bench/command.h"

#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "base/nearest_word.h"

namespace lensd::bench {

namespace {

/// The command with all that it cannot do without: " --picture FILE".
std::string Needed(const CLI::App& app) {
  std::string text;
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_required()) text += " " + option->get_name() + " " + option->get_type_name();
  }
  return text;
}

/// A word that is no option, with what may have been meant.
std::optional<std::string> Unknown(const CLI::App& app) {
  const auto words = app.remaining();
  if (words.empty()) return std::nullopt;
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  const auto option = std::ranges::find_if(words, [](const std::string& word) { return word.starts_with("-"); });
  if (option == words.end()) return "'" + words.front() + "' is no option";
  const auto meant = NearestWord(*option, names);
  return "there is no option " + *option + (meant ? "; did you mean " + *meant + "?" : "");
}

}  // namespace

int ParseThen(CLI::App& app, int argc, char** argv, const std::function<int()>& body) {
  app.name(argv[0]);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    const std::string needed = Needed(app);
    const std::string complaint = Unknown(app).value_or(error.what());
    std::cerr << argv[0] << ": " << complaint << (needed.empty() ? "" : "; write " + std::string(argv[0]) + needed)
              << "; see " << argv[0] << " --help\n";
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
