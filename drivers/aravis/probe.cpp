#include <arv.h>

#include <string>
#include <string_view>

#include "drivers/aravis/driver.h"
#include "gobject_handles.h"

namespace lensd::drivers::aravis {
namespace {

std::string Text(const char* text) {
  return text == nullptr ? "" : text;
}

}  // namespace

Result<std::vector<FoundDevice>> ProbeAravis() {
  TameGlib();
  arv_update_device_list();
  std::vector<FoundDevice> found;
  for (unsigned int i = 0; i < arv_get_n_devices(); ++i) {
    FoundDevice device;
    device.model = Text(arv_get_device_vendor(i)) + " " + Text(arv_get_device_model(i));
    device.serial = Text(arv_get_device_serial_nbr(i));
    device.node = Text(arv_get_device_protocol(i)) + " " + Text(arv_get_device_address(i));
    device.config =
        device.serial.empty() ? "id = \"" + Text(arv_get_device_id(i)) + "\"" : "serial = \"" + device.serial + "\"";
    device.camera = true;
    found.push_back(std::move(device));
  }
  return found;
}

}  // namespace lensd::drivers::aravis
