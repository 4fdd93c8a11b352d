// What a discrete Fourier transform needs to know of its length.
#pragma once

#include <vector>

namespace lensd::sim {

/// One length of a discrete Fourier transform: its factors and the roots of unity each stage multiplies by.
struct FourierPlan {
  struct Stage {
    int radix;
    int length;                     ///< of the blocks this stage splits
    std::vector<float> cos_values;  ///< (radix - 1) a place in a part: cos and -sin of 2 pi place k / length, k = 1..
    std::vector<float> sin_values;
  };
  int size;
  std::vector<Stage> stages;
  explicit FourierPlan(int length);  ///< a product of 2, 3 and 5
};

}  // namespace lensd::sim
