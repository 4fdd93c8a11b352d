// A focus map in the units in which people read and adjust lenses.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "autofocus/focus_map.h"
#include "base/units.h"
#include "drivers/api/camera.h"
#include "rig/optics_table.h"

namespace lensd::rig {

struct FocusMapOutcome {
  struct Cell {
    drivers::Region region;
    autofocus::MapCell found;               ///< positions are extensions in metres
    std::optional<Native> position = {};    ///< in focus there; nothing: `found.cause` says why
    std::optional<Dioptres> vergence = {};  ///< likewise
  };
  /// How best focus changes along one side of the frame. Each reading explains all of it.
  struct Tilt {
    Metres rise;                              ///< extension at the right (lower) edge beyond that at the left (upper)
    Metres sigma;                             ///< standard deviation of that
    std::optional<double> sensor = {};        ///< radians, were it the sensor's; nothing: its pixels are not known
    std::optional<double> sensor_sigma = {};  ///< radians
    std::optional<double> target = {};        ///< radians, were it the target's: its right (lower) edge so much nearer;
                                              ///< nothing: likewise, or so far away that no turn of it would explain it
  };
  struct Surface {
    Tilt across;
    Tilt down;
    std::optional<Metres> curvature;  ///< extension at the corners beyond the middle; nothing: too few regions
    Metres curvature_sigma;
    Metres scatter;                 ///< of the regions, beyond their own sigmas
    Metres left;                    ///< the region farthest from focus where the lens now stands is off by this
    std::optional<double> left_px;  ///< the blur's diameter there; nothing: f-number or pixels are not known
    int used = 0;                   ///< regions
  };
  autofocus::MapGrid grid;
  std::vector<Cell> cells = {};         ///< row by row
  std::optional<Surface> surface = {};  ///< nothing: refused
  Metres best;                          ///< extension for the whole frame
  double magnification = 0.0;           ///< of the picture: size on the sensor over that of the target, at `best`
};

FocusMapOutcome FocusMapOutcomeOf(const autofocus::FocusMap& map, const OpticsTable& optics,
                                  const autofocus::Setup& setup);

}  // namespace lensd::rig
