// The help of a command, and what to say where a command line makes no sense.
#pragma once

#include <string>

#include "cli/terminal/session.h"

namespace CLI {
class ParseError;
}  // namespace CLI

namespace lensd::cli {

/// Everything about a command, reached by `name` ("lensctl focus"), for a terminal of 80 columns. Ends in a line break.
std::string HelpText(const CLI::App& command, const std::string& name);

/// What was wrong with the command line, what may have been meant, and where to read on. `root` has parsed it.
Failure UsageFailure(const CLI::App& root, const CLI::ParseError& error);

/// Whether a word stands where `root`, which has parsed the command line, has a command, and no command has this name.
bool NamesNoCommand(const CLI::App& root);

/// help [COMMAND]; `root` has every other command.
void AddHelp(CLI::App& root, Run& run);

}  // namespace lensd::cli
