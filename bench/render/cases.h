// What lens-bench render measures: one row a renderer, scene and diameter.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.h"

namespace lensd::bench {

/// Errors are in levels of an 8-bit picture (1/255 of full scale), exceeded by one pixel in a thousand (or the largest
/// of the pixels sampled); none where there are no such pixels.
struct RenderRow {
  std::string family{};    ///< "one disk", "varying disk" or "scene"
  std::string scene{};     ///< of family "scene"
  std::string renderer{};  ///< ours, or a peer's name
  bool peer = false;
  std::optional<double> diameter_px{};
  std::optional<int> rays{};
  double elapsed_ms = 0.0;  ///< CPU time of the one thread
  std::optional<double> interior_error{};
  std::optional<double> boundary_error{};  ///< within a blur radius of where something hides something else
  std::optional<double> error_bound{};     ///< as the renderer states it; of scenes only
  std::optional<double> p99_error{};       ///< of all pixels, exceeded by one in a hundred; of scenes only
};

struct RenderBenchOptions {
  int width = 1920;
  int height = 1080;
  int repeats = 5;
};

/// One disk over white noise, every method and peer, diameters from 1 to 101 px; errors against the sum in double
/// precision over the disk's exact areas, at pixels taken at random.
std::vector<RenderRow> OneDiskRows(const RenderBenchOptions& options);

/// Diameters from 1 to 41 px across the frame, against each pixel's own sum.
std::vector<RenderRow> VaryingDiskRows(const RenderBenchOptions& options);

/// Small scenes in which things hide each other, or the scene of a file at its own size in three states of focus,
/// against rays in great number. BadData, Io: the file.
Result<std::vector<RenderRow>> SceneRows(const std::string& path);

}  // namespace lensd::bench
