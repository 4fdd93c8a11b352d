// One scene through a pinhole, a hole, a lens and the lens stopped down, and a tilted plane: what the lessons say,
// seen.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "io/png.h"

namespace lensd::bench {

/// A rendered frame.
struct GalleryFrame {
  std::string name;  ///< of its file, without the ending
  std::string says;  ///< the opening and what came of it, one line
  io::Image image;
};

/// `scenes` is the folder of the sources. All frames are equally bright: how much longer the darker ones would have to
/// be exposed is said. Noise is left out, and so is diffraction, which the simulator does not have. Errors: as
/// LoadScene().
Result<std::vector<GalleryFrame>> Frames(const std::string& scenes);

}  // namespace lensd::bench
