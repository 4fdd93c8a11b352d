// The service side of io.lensd.Driver: serves the devices of one driver of drivers/api to lensd, in a process of its
// own.
#pragma once

#include "base/clock.h"
#include "drivers/api/device.h"

namespace lensd::drivers::host {

/// Serves the devices of `driver` on the listening socket that this process inherited (LISTEN_FDS, LISTEN_PID), each
/// connection on a thread of its own, until the last one has ended. Then what moves is stopped and the devices are
/// closed, for at most kCloseAtMost, and the process ends: with exit status 0, 70 where a call of the driver threw, or
/// 64 where there is no such socket. SIGTERM, SIGINT and SIGHUP do nothing. To be called by main(), before any thread
/// begins.
[[noreturn]] void RunHost(const Driver& driver);

inline constexpr Duration kCloseAtMost = std::chrono::milliseconds(1500);

}  // namespace lensd::drivers::host
