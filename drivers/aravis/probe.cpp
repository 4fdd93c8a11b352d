// What `lensctl devices` shows of GenICam cameras on the network and on USB. Each is opened for as long as its
// description takes, which says whether it moves a lens.
#include <chrono>
#include <string>

#include "aravis_lens.h"
#include "camera_search.h"
#include "drivers/aravis/driver.h"
#include "gobject_handles.h"

namespace lensd::drivers::aravis {
namespace {

/// A camera that another program controls lets itself be read; one on USB that is in use does not, and stays unknown.
bool HasLens(const ListedCamera& listed) {
  const auto opened = OpenListed(listed);
  if (!opened) return false;
  const auto lens = FindLens(opened->camera.get(), {});
  return lens && lens->any();
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
    device.lens = std::chrono::steady_clock::now() - began < kAskAtMost && HasLens(camera);
    found.push_back(std::move(device));
  }
  return found;
}

}  // namespace lensd::drivers::aravis
