// Opening: a process, its connections, the device, and what it is.
#include "drivers/process/process.h"

#include <utility>

#include "parts.h"

namespace lensd::drivers::process {

Result<Device> OpenInProcess(const Program& program, const Settings& settings, const Clock& clock) {
  auto remote = Remote::Open(program, settings);
  if (!remote) return PassOn(remote);
  const auto described = (*remote)->Call(Remote::By::Lens, "Describe");
  if (!described) return PassOn(described);
  auto description = wire::DescriptionFrom(*described, program.driver);
  if (!description) return PassOn(description);
  Device device;
  device.optics = description->optics;
  device.findings = std::move(description->findings);
  if (description->lens) device.lens = MakeLens(*remote, *std::move(description->lens), clock);
  if (description->camera) device.camera = MakeCamera(*remote, *std::move(description->camera), clock);
  return device;
}

}  // namespace lensd::drivers::process
