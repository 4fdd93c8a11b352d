// Whole steps, at most eight of them.
#include "cli/text/vergence_axis.h"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "base/quantity_text.h"

namespace lensd::cli {

io::Axis VergenceAxis(Dioptres far, Dioptres near) {
  constexpr double kMostTicks = 8.0;
  const double raw = (near.value - far.value) / kMostTicks;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  const double step = power * (raw <= 2.0 * power ? 2.0 : raw <= 5.0 * power ? 5.0 : 10.0);
  std::vector<std::pair<double, std::string>> ticks;
  for (double index = std::ceil(far.value / step); index * step <= near.value; ++index) {
    const double u = index * step;
    ticks.emplace_back(u, Short(u, 4) + "\n" + (u > 0.0 ? LengthText(Metres{1.0 / u}, 3) : "infinity"));
  }
  return {.label = "vergence of the subject [D], its distance below",
          .low = far.value,
          .high = near.value,
          .ticks = std::move(ticks)};
}

}  // namespace lensd::cli
