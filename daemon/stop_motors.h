// What is left to do after a lensd that was killed: its motors may still run.
#pragma once

#include "base/clock.h"
#include "daemon/config/config.h"

namespace lensd::daemon {

/// Opens every configured lens, all at once, and stops each axis that can be stopped; homes and parks nothing. Returns
/// once all are done, at the latest after two seconds. What failed is logged; the answer is how many lenses that is.
/// Threads that still hang in a driver then hold on to `config` and `clock`: end the process without destroying them.
int StopMotors(const Config& config, const Clock& clock);

}  // namespace lensd::daemon
