// What the live screen shows, as lines.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "cli/terminal/terminal.h"
#include "varlink/json.h"

namespace lensd::cli {

/// Everything that is known when it is drawn.
struct WatchedState {
  std::vector<varlink::Json> lenses;           ///< LensStatus, in the daemon's order
  std::map<std::string, varlink::Json> infos;  ///< LensInfo by name
  std::size_t selected = 0;                    ///< of `lenses`
  std::optional<double> sharpness;             ///< of the newest frame of the selected lens
  double best_sharpness = 0.0;                 ///< seen of it so far
  std::string said;                            ///< how the last command went
};

/// One line a lens, more for the selected one, and what can be typed.
std::vector<StyledLine> WatchLines(const WatchedState& state, TerminalScreen::Size size);

}  // namespace lensd::cli
