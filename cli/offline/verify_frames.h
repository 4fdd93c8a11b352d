// The picture files of `lensctl verify`, read and checked against each other.
#pragma once

#include <expected>
#include <optional>
#include <string>
#include <vector>

#include "cli/terminal/session.h"
#include "verify/relative_blur.h"

namespace lensd::cli {

/// The names of the files as written.
struct VerifyFiles {
  std::string picture;
  std::vector<std::string> references;
  std::string depth_map;
};

/// All that is compared.
struct VerifyFrames {
  verify::FramesToCompare frames;
  std::vector<float> depth_m;             ///< a pixel each, 0: unknown
  std::optional<std::string> doubt = {};  ///< what a person should know before trusting the result
};

/// Reads them. Of colours the green alone is taken: its noise depends on its own level only. Of more than two
/// references every other one is averaged. `opening`: see FramesToCompare; nothing: by the f-numbers that the files say
/// of themselves. Usage: fewer than two references, or the same file twice. NoInput. BadData: no PNG, other sizes, a
/// depth map that is none, different lenses, no f-number, or references whose aperture is not smaller than the
/// picture's.
std::expected<VerifyFrames, Failure> ReadVerifyFrames(const VerifyFiles& files, std::optional<double> opening);

}  // namespace lensd::cli
