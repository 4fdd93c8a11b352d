// The command line of lens-run, as a list of things to do.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "base/settings.h"

namespace lensd::tools {

/// One command and its words.
struct Command {
  std::string name;
  std::vector<std::string> words;
};

struct Script {
  std::string driver;  ///< empty: none was named
  Settings settings;
  double timeout_s = 30.0;  ///< how long a motion or a frame may take
  std::vector<Command> commands;
};

/// "focus.limits=[0, 100]" and the like become settings: values are TOML, anything else is text. InvalidArgument: not a
/// command, or too few words for one.
Result<Script> ReadScript(const std::vector<std::string>& arguments);

/// What --help prints.
std::string HelpText();

}  // namespace lensd::tools
