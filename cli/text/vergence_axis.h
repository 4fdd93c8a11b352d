// The axis on which blur is straight: vergence, with distances for readers who think in them.
#pragma once

#include "base/units.h"
#include "io/svg.h"

namespace lensd::cli {

/// From the far end to the near end, whole steps of vergence with their distances below. `far` < `near`.
io::Axis VergenceAxis(Dioptres far, Dioptres near);

}  // namespace lensd::cli
