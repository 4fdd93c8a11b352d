// What a driver's process gives up before its driver runs.
#pragma once

#include "drivers/host/host.h"

namespace lensd::drivers::host {

/// As RunHost() says. Before any thread begins.
void Confine(const Confinement& confinement);

}  // namespace lensd::drivers::host
