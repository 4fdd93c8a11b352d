// The service side of io.lensd.Driver: serves the devices of one driver of drivers/api to lensd, in a process of its
// own.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "base/clock.h"
#include "drivers/api/device.h"

namespace lensd::drivers::host {

/// What a driver may reach beside what every driver may: reading files outside /dev, sockets of AF_UNIX and AF_NETLINK.
struct Confinement {
  bool network = false;            ///< sockets of AF_INET and AF_INET6
  std::vector<std::string> paths;  ///< devices, files, and folders of devices, that it opens for reading and writing
};

/// Gives up for good what `confinement` does not allow, running other programs, and memory beyond kMemoryAtMost; what
/// the kernel cannot refuse is printed to stderr, a line each. Then serves the devices of `driver` on the listening
/// socket that this process inherited (LISTEN_FDS, LISTEN_PID), each connection on a thread of its own, until the last
/// one has ended. Then what moves is stopped and the devices are closed, for at most kCloseAtMost, and the process
/// ends: with exit status 0, 70 where a call of the driver threw, or 64 where there is no such socket. SIGTERM, SIGINT
/// and SIGHUP do nothing. To be called by main(), before any thread begins.
[[noreturn]] void RunHost(const Driver& driver, const Confinement& confinement = {});

inline constexpr Duration kCloseAtMost = std::chrono::milliseconds(1500);
inline constexpr std::size_t kMemoryAtMost = std::size_t{1} << 30;  ///< bytes of addresses; no limit under sanitizers

}  // namespace lensd::drivers::host
