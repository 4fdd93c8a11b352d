// The explicit table of lensctl's commands, in the order of `lensctl --help`. A new command is one declaration and one
// line in kCommands.
#pragma once

#include <initializer_list>

#include "cli/session.h"

namespace lensd::cli {

inline constexpr std::initializer_list<AddCommand> kCommands = {
    // offline
};

}  // namespace lensd::cli
