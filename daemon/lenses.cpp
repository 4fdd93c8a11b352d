#include "lenses.h"

#include <utility>

namespace lensd::daemon {
namespace {

/// Names the lens, and the place too unless the message begins with one of its own. A file that is named and cannot be
/// read is a mistake of the configuration.
Error AtLens(const LensConfig& config, Error error) {
  const std::string place = error.code == Code::BadData ? "" : config.where.Text() + ": ";
  const Code code = error.code == Code::Io ? Code::BadData : error.code;
  return {code, place + "lens \"" + config.name + "\": " + error.message};
}

Result<std::unique_ptr<drivers::Camera>> OpenCamera(const DeviceConfig& config, const Clock& clock) {
  auto device = config.driver->open(config.settings, clock);
  if (!device) return PassOn(std::move(device));
  if (!device->camera) return Fail(Code::BadData, config.settings.where().Text() + ": this device has no camera");
  return std::move(device->camera);
}

}  // namespace

Result<drivers::Device> OpenDevice(const LensConfig& config, const Clock& clock) {
  auto device = config.device.driver->open(config.device.settings, clock);
  if (!device) return std::unexpected(AtLens(config, device.error()));
  if (!device->lens) return std::unexpected(AtLens(config, {Code::BadData, "this device has no lens"}));
  if (!config.camera) return device;
  if (device->camera) {
    const std::string place = config.camera->settings.where().Text();
    return Fail(Code::BadData, place + ": the lens' own driver brings a camera already; remove [lens.camera]");
  }
  auto camera = OpenCamera(*config.camera, clock);
  if (!camera) return std::unexpected(AtLens(config, camera.error()));
  device->camera = *std::move(camera);
  return device;
}

Result<void> OpenLenses(const Config& config, const Clock& clock, LensService& service) {
  for (const LensConfig& lens : config.lenses) {
    auto device = OpenDevice(lens, clock);
    if (!device) return PassOn(std::move(device));
    auto added = service.AddLens(lens, *std::move(device));
    if (!added) return std::unexpected(AtLens(lens, added.error()));
  }
  return {};
}

}  // namespace lensd::daemon
