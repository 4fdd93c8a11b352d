// A length is split by its factors: 5 and 3 first, then 4 and 2. The roots of unity are worked out one by one, each to
// rounding.
#include "sim/render/fourier_plan.h"

#include <cmath>
#include <numbers>
#include <utility>

namespace lensd::sim {

FourierPlan::FourierPlan(int length) : size(length) {
  int rest = length;
  while (rest > 1) {
    const int radix = rest % 5 == 0 ? 5 : rest % 3 == 0 ? 3 : rest % 4 == 0 ? 4 : 2;
    Stage stage{radix, rest, {}, {}};
    for (int place = 0; place < rest / radix; ++place) {
      for (int k = 1; k < radix; ++k) {
        const double angle = -2.0 * std::numbers::pi * place * k / rest;
        stage.cos_values.push_back(static_cast<float>(std::cos(angle)));
        stage.sin_values.push_back(static_cast<float>(std::sin(angle)));
      }
    }
    stages.push_back(std::move(stage));
    rest /= radix;
  }
}

}  // namespace lensd::sim
