// lens-bench drivers: what a driver adds to its device, and what it tells when exchanges go wrong.
#pragma once

namespace lensd::bench {

int RunDrivers(int argc, char** argv);

}  // namespace lensd::bench
