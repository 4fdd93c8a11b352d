// One or two things to type for each command; tests run every one of them on a simulated lens called cam.
#pragma once

#include <string_view>
#include <vector>

#include "cli/help/command_tree.h"

namespace lensd::cli {

/// Of the command that is reached by `name`, such as "lensctl focus".
std::vector<Example> ExamplesOf(std::string_view name);

}  // namespace lensd::cli
