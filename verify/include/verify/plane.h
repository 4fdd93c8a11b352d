// One colour of a picture.
#pragma once

#include <vector>

namespace lensd::verify {

/// Grey levels, row-major, width * height.
struct Plane {
  int width = 0;   ///< px
  int height = 0;  ///< px
  std::vector<float> values;
};

}  // namespace lensd::verify
