// lensd-driver: serves the devices of one driver to lensd, in a process of its own.
#include <sysexits.h>

#include <cstdio>
#include <span>

#include "daemon/config/drivers_table.h"
#include "drivers/host/host.h"

int main(int count, char** words) {
  const std::span<char*> arguments(words, static_cast<std::size_t>(count));
  if (const auto done = lensd::daemon::BeginDrivers(arguments)) return *done;
  const lensd::drivers::Driver* driver = count == 2 ? lensd::daemon::FindDriver(words[1]) : nullptr;
  if (driver == nullptr) {
    std::fprintf(stderr, "usage: lensd-driver NAME, which lensd runs; NAME is one of %s\n",
                 lensd::daemon::DriverNames().c_str());
    return EX_USAGE;
  }
  lensd::drivers::host::RunHost(*driver);
}
