// Best focus over the frame: where each region of a grid is in focus, found on one set of frames, and the smooth
// surface that they lie on. A flat target seen by a sensor and a lens that are square to it gives one place of focus; a
// tilt of any of the three makes that a plane over the frame, and a lens whose field is not flat a bowl.
#pragma once

#include <array>
#include <expected>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "autofocus/region_search.h"

namespace lensd::autofocus {

/// The frame in equal parts.
struct MapGrid {
  int columns = 5;
  int rows = 4;
  static constexpr int kMost = 12;  ///< of each
  static constexpr int kLeast = 2;
};
/// Row by row.
std::vector<drivers::Region> RegionsOf(const MapGrid& grid);

/// Where in the frame a region's texture lies, its mean: from the frame's middle, in half diagonals, and the mean
/// square of that distance.
struct FieldPlace {
  double x = 0.0;  ///< to the right
  double y = 0.0;  ///< downward
  double square = 0.0;
};

/// One region of a map.
struct MapCell {
  FieldPlace place = {};
  std::optional<double> position = {};  ///< of best focus; nothing: `cause` says why
  double sigma = 0.0;                   ///< of that, by the region's own frames
  Cause cause = Cause::Unclear;
  std::string reason = {};  ///< why there is none
  double off = 0.0;         ///< position beyond the fitted surface
  bool outlier = false;     ///< too far off to lie on it: left out of the fit
};

/// position = middle + x tilt, y tilt and curvature times the squared distance from the frame's middle. In the lens'
/// positions and, of the frame, half diagonals.
struct FocusSurface {
  static constexpr std::size_t kTerms = 4;
  std::array<double, kTerms> terms{};   ///< middle, by x, by y, curvature: what the corners have beyond the middle
  std::array<double, kTerms> sigmas{};  ///< standard deviations
  bool curved = true;                   ///< false: too few regions to tell; the curvature is taken for 0
  double scatter = 0.0;                 ///< standard deviation of the regions beyond their own sigmas
  int used = 0;                         ///< regions

  double At(const FieldPlace& place) const {
    return terms[0] + terms[1] * place.x + terms[2] * place.y + terms[3] * place.square;
  }
};

/// Why there is no surface.
struct NoSurface {
  Cause cause = Cause::Unclear;
  std::string reason;
};

/// Fits the surface by weighted least squares and says of every cell how far off it is and whether it is an outlier,
/// farther than 3.5 standard deviations. What the regions scatter beyond their own sigmas is estimated from them and
/// counts as error of each. `unit`: a change of position that shows, such as one pixel of blur; nothing nearer to the
/// surface than a quarter of it is an outlier.
std::expected<FocusSurface, NoSurface> FitSurface(std::vector<MapCell>& cells, double unit);

struct FocusMap {
  MapGrid grid;
  int width_px = 0;            ///< of the frame
  int height_px = 0;           ///< likewise
  double width = 0.0;          ///< of the frame, in half diagonals
  double height = 0.0;         ///< likewise
  std::vector<MapCell> cells;  ///< row by row
  std::optional<FocusSurface> surface;
  double best = 0.0;  ///< where the lens stands so that the middles of the regions are least out of focus
  double left = 0.0;  ///< so far from there the farthest of them is in focus
};

/// A run that makes a map: one search of the range, finer where any region is sharpest, then to the best common focus
/// and a frame there that has to be as sharp as the search promised. `setup` has a frame of its own camera's size in
/// mind: the map's width and height follow from the first frame. InvalidArgument: a grid with too many or too few
/// regions.
Result<std::unique_ptr<RegionSearch>> MakeMapSearch(const Setup& setup, const MapGrid& grid);

}  // namespace lensd::autofocus
