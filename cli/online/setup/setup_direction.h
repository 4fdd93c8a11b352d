// Which way focus turns, by a subject whose distance is known: for `lensctl setup`.
#pragma once

#include <string>

namespace lensd::cli {

/// Of a distance that a person gives: what it is not known better than, as a standard deviation.
inline constexpr double kDistanceError = 0.02;

/// What autofocus found at a known distance, and the optics it was told by. Vergences are dioptres from the lens
/// centre, lengths mm.
struct DirectionFacts {
  double given = 0.0;        ///< where the subject is
  double found = 0.0;        ///< where the configuration places what is in focus
  double found_sigma = 0.0;  ///< how surely focus is on it
  double backlash_mm = 0.0;  ///< of extension: what a reversal loses
  double focal_length = 0.0, extension_min = 0.0, extension_max = 0.0;
};

/// "right", "reversed", or "undecided": a lens that turns the other way stands where the mirrored extension says. One
/// is told only where it is clearly the better explanation, and the other contradicts both the search and the distance.
std::string DirectionBy(const DirectionFacts& facts);

}  // namespace lensd::cli
