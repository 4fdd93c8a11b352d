// What `lensctl devices` shows of GenICam cameras on the network and on USB. Each that this process has not
// connected is opened for as long as its description takes, which says whether it moves a lens.
#include <chrono>
#include <string>

#include "aravis_lens.h"
#include "camera_search.h"
#include "drivers/aravis/driver.h"
#include "gobject_handles.h"

namespace lensd::drivers::aravis {
namespace {

/// Whether it has a lens, or why it cannot be used. A camera that another program controls lets itself be read; one on
/// USB that is in use does not, and stays unknown.
void LookForLens(const ListedCamera& camera, FoundDevice& device) {
  if (const auto lens = LensOfCameraInUse(camera)) {
    device.lens = *lens;
    return;
  }
  const auto opened = OpenListed(camera);
  if (!opened) {
    if (opened.error().code == Code::Unsupported) device.problem = opened.error().message;
    return;
  }
  const auto lens = FindLens(opened->camera.get(), {});
  device.lens = lens && lens->any();
}

}  // namespace

Result<std::vector<FoundDevice>> ProbeAravis() {
  constexpr auto kAskAtMost = std::chrono::seconds(2);  // a search ends within 3 s, and finding cameras takes one
  TameGlib();
  const auto cameras = SearchCameras();
  if (!cameras) return PassOn(cameras);
  std::vector<FoundDevice> found;
  const auto began = std::chrono::steady_clock::now();
  for (const ListedCamera& camera : *cameras) {
    FoundDevice device;
    device.model = camera.vendor + " " + camera.model;
    device.serial = camera.serial;
    device.node = camera.protocol + " " + camera.address;
    device.config = camera.serial.empty() ? "id = \"" + camera.id + "\"" : "serial = \"" + camera.serial + "\"";
    device.camera = true;
    if (std::chrono::steady_clock::now() - began < kAskAtMost) LookForLens(camera, device);
    found.push_back(std::move(device));
  }
  return found;
}

}  // namespace lensd::drivers::aravis
