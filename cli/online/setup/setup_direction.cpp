// A lens configured the wrong way round stands at the mirror image, within its travel, of the extension that lensd
// reckons. Both are turned into vergences and held against the distance that was given.
#include "cli/online/setup/setup_direction.h"

#include <cmath>

namespace lensd::cli {
namespace {

constexpr double kClearlyNearer = 3;  ///< times: which of two explanations of a distance is the better one
constexpr double kSurely = 3;         ///< standard deviations: what contradicts an explanation

}  // namespace

std::string DirectionBy(const DirectionFacts& facts) {
  const double f = facts.focal_length;
  const double extension = f * f * facts.found / (1e3 - f * facts.found);
  const double mirrored = facts.extension_min + facts.extension_max - extension;
  const double off = std::abs(facts.found - facts.given);
  const double off_mirrored = std::abs(1e3 * mirrored / (f * (f + mirrored)) - facts.given);
  const double lost = 1e3 * facts.backlash_mm / std::pow(f + extension, 2);
  const double unsure = kSurely * std::hypot(facts.found_sigma, kDistanceError * facts.given, lost);
  const auto told = [&](double better, double worse) { return worse > kClearlyNearer * better && worse > unsure; };
  if (told(off, off_mirrored)) return "right";
  return told(off_mirrored, off) ? "reversed" : "undecided";
}

}  // namespace lensd::cli
