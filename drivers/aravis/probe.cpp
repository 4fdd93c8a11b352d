// What `lensctl devices` shows of GenICam cameras on the network and on USB. Each is opened for as long as its
// description takes, which says whether it moves a lens.
#include <arv.h>

#include <chrono>
#include <string>
#include <string_view>

#include "aravis_lens.h"
#include "drivers/aravis/driver.h"
#include "gobject_handles.h"

namespace lensd::drivers::aravis {
namespace {

std::string Text(const char* text) {
  return text == nullptr ? "" : text;
}

/// A camera that another program controls lets itself be read; one on USB that is in use does not, and stays unknown.
bool HasLens(const char* id) {
  CallError error;
  const Handle<ArvCamera> camera(arv_camera_new(id, error.out()));
  if (!camera) return false;
  const auto lens = FindLens(camera.get(), {});
  return lens && lens->any();
}

}  // namespace

Result<std::vector<FoundDevice>> ProbeAravis() {
  constexpr auto kAskAtMost = std::chrono::seconds(2);  // a search ends within 3 s, and finding cameras takes one
  TameGlib();
  arv_update_device_list();
  std::vector<FoundDevice> found;
  const auto began = std::chrono::steady_clock::now();
  for (unsigned int i = 0; i < arv_get_n_devices(); ++i) {
    FoundDevice device;
    device.model = Text(arv_get_device_vendor(i)) + " " + Text(arv_get_device_model(i));
    device.serial = Text(arv_get_device_serial_nbr(i));
    device.node = Text(arv_get_device_protocol(i)) + " " + Text(arv_get_device_address(i));
    device.config =
        device.serial.empty() ? "id = \"" + Text(arv_get_device_id(i)) + "\"" : "serial = \"" + device.serial + "\"";
    device.camera = true;
    device.lens = std::chrono::steady_clock::now() - began < kAskAtMost && HasLens(arv_get_device_id(i));
    found.push_back(std::move(device));
  }
  return found;
}

}  // namespace lensd::drivers::aravis
