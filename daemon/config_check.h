// lensd --check-config: all that is wrong with a configuration, told at once.
#pragma once

#include <string>

#include "base/clock.h"

namespace lensd::daemon {

/// Reads the file, its drop-ins and what they name, and opens the devices of the lenses that have no mistake. Prints
/// each mistake to stderr as "file:line: what, why", in the order of the files and their lines, and nothing else; of a
/// configuration without any, one line to stdout, and to stderr what would keep a lens waiting. `state`: the folder for
/// what outlives lensd; empty: there is none. Returns the exit status.
int CheckConfiguration(const std::string& path, const std::string& state, const Clock& clock);

}  // namespace lensd::daemon
