// Picture files as the frames of a stack: in which order, and what is known of each.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/terminal/session.h"

namespace lensd::cli {

/// One frame, by what its file says of it (`lensctl snapshot` and `lensctl stack` write that). Nothing: not known.
struct Shot {
  std::string file;
  std::string lens;
  std::optional<double> vergence_d, extension_mm, focal_length_mm, f_number, position;
  bool merged = false;  ///< it is what `lensctl merge` made
};

/// What one PNG file says of itself. NoInput, and BadData where it is no PNG.
std::expected<Shot, Failure> ReadShot(const std::string& file);

/// What the frames are in order of.
enum class ShotOrder {
  Vergence,  ///< from far to near
  Position,  ///< of the focus motor: the lens was not calibrated
  Names,     ///< of the files: nothing was known of the lens
};

struct ShotStack {
  std::vector<Shot> shots;
  ShotOrder order = ShotOrder::Vergence;

  /// The coordinate that blur goes with.
  double PlaceOf(std::size_t shot) const;
};

/// The frames that make up a stack. `paths`: files, or folders whose PNG files are meant, but for those that are merged
/// already. NoInput: a file, or one of a numbered row (shot-2.png) in a folder, is not there. BadData: fewer than two,
/// two in the same focus, different f-numbers or lenses, or some know where they were focused and others do not.
std::expected<ShotStack, Failure> ReadShots(const std::vector<std::string>& paths);

}  // namespace lensd::cli
