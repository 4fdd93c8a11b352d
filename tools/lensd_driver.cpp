// lensd-driver: serves the devices of one driver to lensd, in a process of its own, which may open the devices of this
// driver alone. An aravis camera is not tried in yet another process first: this one may crash.
#include <sysexits.h>

#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>

#include "daemon/config/drivers_table.h"
#include "drivers/host/host.h"

namespace {

/// Those in /dev whose names begin so.
void AddNodes(std::string_view beginning, std::vector<std::string>& paths) {
  if (beginning.contains('/')) return paths.push_back("/dev/" + std::string(beginning));
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/dev", error)) {
    if (entry.path().filename().string().starts_with(beginning)) paths.push_back(entry.path());
  }
}

}  // namespace

int main(int count, char** words) {
  const lensd::drivers::Driver* driver = count >= 2 ? lensd::daemon::FindDriver(words[1]) : nullptr;
  if (driver == nullptr) {
    std::fprintf(stderr,
                 "usage: lensd-driver NAME [PATH...], which lensd runs; NAME is one of %s, and each PATH a device or a "
                 "file that the driver may open for writing\n",
                 lensd::daemon::DriverNames().c_str());
    return EX_USAGE;
  }
  const lensd::daemon::DriverNeeds& needs = lensd::daemon::NeedsOf(driver->name);
  lensd::drivers::host::Confinement confinement{.network = needs.network, .paths = {words + 2, words + count}};
  for (const std::string_view beginning : needs.nodes) AddNodes(beginning, confinement.paths);
  lensd::drivers::host::RunHost(*driver, confinement);
}
