// Opens what the configuration names: lens, camera, calibration and kept positions of one lens.
#include "lenses.h"

#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "base/settings_problems.h"
#include "config_faults.h"
#include "replug.h"

namespace lensd::daemon {
namespace {

/// Names the lens, and the place too unless the message begins with one of its own. A file that is named and cannot be
/// read is a mistake of the configuration; a device node that may not be opened is not.
Error AtLens(const LensConfig& config, const Error& error) {
  const std::string place = error.code == Code::BadData ? "" : config.where.Text() + ": ";
  const Code code = error.code == Code::Io && !config.device.driver->reopen ? Code::BadData : error.code;
  return {code, place + "lens \"" + config.name + "\": " + error.message};
}

/// With `signal`, a device that is opened anew when it vanishes.
Result<drivers::Device> OpenOne(const DeviceConfig& config, const Clock& clock, PlugSignal* signal) {
  auto device = config.driver->open(config.settings, clock);
  if (!device || signal == nullptr || !config.driver->reopen) return device;
  const auto open = [config, &clock] { return config.driver->open(config.settings, clock); };
  return SurviveUnplugging(*std::move(device), open, *signal);
}

Result<std::unique_ptr<drivers::Camera>> OpenCamera(const DeviceConfig& config, const Clock& clock,
                                                    PlugSignal* signal) {
  auto device = OpenOne(config, clock, signal);
  if (!device) return PassOn(device);
  if (!device->camera) return Fail(Code::BadData, config.settings.where().Text() + ": this device has no camera");
  return std::move(device->camera);
}

}  // namespace

Result<void> CheckSettings(const LensConfig& config) {
  std::optional<SettingsProblems> own;
  if (SettingsProblems::Current() == nullptr) own.emplace();
  SettingsProblems& problems = *SettingsProblems::Current();
  const std::span<const std::string_view> beside = OwnLensKeys();
  problems.KeysBeside(config.device.settings, {beside.begin(), beside.end()});
  Result<void> first;
  for (const DeviceConfig* device : {&config.device, config.camera ? &*config.camera : nullptr}) {
    if (device == nullptr || device->driver == nullptr || device->driver->check == nullptr) continue;
    const auto checked = device->driver->check(device->settings);
    if (checked) continue;
    problems.Add(checked.error().message, device->settings.where());
    if (first) first = PassOn(AtLens(config, checked.error()));
  }
  return first;
}

Result<drivers::Device> OpenDevice(const LensConfig& config, const Clock& clock, PlugSignal* signal) {
  auto device = OpenOne(config.device, clock, signal);
  if (!device) return PassOn(AtLens(config, device.error()));
  if (!device->lens) return PassOn(AtLens(config, {Code::Unsupported, "this device has no lens"}));
  if (!config.camera) return device;
  if (device->camera) {
    const std::string place = config.camera->settings.where().Text();
    return Fail(Code::BadData, place + ": the lens' own driver brings a camera already; remove [lens.camera]");
  }
  auto camera = OpenCamera(*config.camera, clock, signal);
  if (!camera) return PassOn(AtLens(config, camera.error()));
  device->camera = *std::move(camera);
  return device;
}

Result<void> CheckAll(const Config& config) {
  for (const LensConfig& lens : config.lenses) {
    if (auto checked = CheckSettings(lens); !checked) return checked;
  }
  return {};
}

ServedLens::Open OpenerOf(const LensConfig& lens, const Clock& clock, LensService& service) {
  return [lens, &clock, &service] { return OpenDevice(lens, clock, &service.plug_signal()); };
}

Result<void> AddLenses(const Config& config, const Clock& clock, LensService& service) {
  if (auto checked = CheckAll(config); !checked) return checked;
  for (const LensConfig& lens : config.lenses) service.AddLens(lens, OpenerOf(lens, clock, service));
  return {};
}

}  // namespace lensd::daemon
