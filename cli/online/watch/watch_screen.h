// status --watch on a terminal: one live screen.
#pragma once

#include <string>

#include "cli/terminal/session.h"

namespace lensd::cli {

/// Shows the lens of that name, or all where it is empty, until q, a signal or --timeout.
Outcome WatchScreen(Session& session, const std::string& lens);

}  // namespace lensd::cli
