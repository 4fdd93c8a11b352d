// Opens what the configuration names: lens, camera, calibration and kept positions of one lens.
#include "daemon/methods/lenses.h"

#include <algorithm>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/settings_problems.h"
#include "daemon/config/config_faults.h"
#include "daemon/lens/replug.h"
#include "daemon/methods/open_driver.h"

namespace lensd::daemon {
namespace {

using drivers::Axis;
using drivers::AxisName;

/// Names the lens, and the place too unless the message begins with one of its own. A file that is named and cannot be
/// read is a mistake of the configuration; a device node that may not be opened is not.
Error AtLens(const LensConfig& config, const Error& error) {
  const std::string place = error.code == Code::BadData ? "" : config.where.Text() + ": ";
  const Code code = error.code == Code::Io && !config.device.driver->reopen ? Code::BadData : error.code;
  return {code, place + "lens \"" + config.name + "\": " + error.message};
}

/// A camera whose lens was left out still shows pictures: then the lens has no axes.
Result<drivers::Device> OpenOnce(const DeviceConfig& config, const Clock& clock) {
  auto device = OpenDriver(config, clock);
  if (!device || device->lens || !device->camera) return device;
  if (std::ranges::none_of(drivers::kAxes, [&](Axis axis) { return device->findings.Of(AxisName(axis)) != nullptr; })) {
    return device;
  }
  const drivers::CameraCapabilities& camera = device->camera->capabilities();
  device->lens = drivers::LensWithoutAxes(
      {.driver = camera.driver, .model = camera.model, .serial = camera.serial, .axes = {}}, clock);
  return device;
}

/// With `signal`, a device that is opened anew when it vanishes.
Result<drivers::Device> OpenOne(const DeviceConfig& config, const Clock& clock, PlugSignal* signal) {
  auto device = OpenOnce(config, clock);
  const bool reopens = config.driver->reopen || config.process;  // a process that ended is no device any more
  if (!device || signal == nullptr || !reopens) return device;
  const auto open = [config, &clock] { return OpenOnce(config, clock); };
  // A driver that finds its device again by itself reads from it what is homed.
  return SurviveUnplugging(*std::move(device), open, *signal,
                           {.process = config.process != nullptr, .reference = !config.driver->reopen});
}

/// Where these settings name a part: by a table of its name, or by a key that begins with it, such as "zoom_scale".
/// Nothing: they do not.
std::optional<Location> WhereNamed(std::string_view part, const Settings& settings) {
  for (const auto& [key, value] : *settings.AsTable()) {
    if (key == part || key.starts_with(std::string(part) + "_")) return value.where();
  }
  return std::nullopt;
}

/// A part that the configuration names is not left out. Unsupported, or what was the reason: "file:line: ...".
Result<void> RefuseNamed(const LensConfig& config, const Settings& settings, const drivers::Findings& findings) {
  for (const drivers::LeftOut& one : findings.left_out()) {
    const auto where = WhereNamed(one.part, settings);
    if (!where) continue;
    return Fail(one.code, where->Text() + ": lens \"" + config.name + "\": " + one.part +
                              " is configured here and cannot be used: " + one.reason);
  }
  return {};
}

/// A table of an axis that the lens does not have is a mistake, or of another lens.
Result<void> RefuseMissing(const LensConfig& config, const drivers::Capabilities& can) {
  for (const drivers::Axis axis : drivers::kAxes) {
    const std::string name(drivers::AxisName(axis));
    const auto table = config.table.AsTable()->find(name);
    if (table == config.table.AsTable()->end() || can.axes[axis]) continue;
    std::ostringstream text;
    text << table->second.where().Text() << ": lens \"" << config.name << "\": [lens." << name
         << "] is configured here, and this lens has no " << name << ": remove the table";
    return Fail(Code::Unsupported, text.str());
  }
  return {};
}

/// What was found of a device of which only the lens is used, or only the camera.
drivers::Findings HalfOf(const drivers::Findings& findings, bool lens) {
  drivers::Findings half;
  for (const drivers::LeftOut& one : findings.left_out()) {
    if (drivers::AxisFromName(one.part).has_value() == lens) half.LeaveOut(one.part, {one.code, one.reason});
  }
  for (const std::string& doubt : lens ? findings.doubts() : std::vector<std::string>()) half.Doubt(doubt);
  return half;
}

struct OpenedCamera {
  std::unique_ptr<drivers::Camera> camera;
  drivers::Findings findings;
};

Result<OpenedCamera> OpenCamera(const LensConfig& config, const Clock& clock, PlugSignal* signal) {
  const DeviceConfig& camera = *config.camera;
  auto device = OpenOne(camera, clock, signal);
  if (!device) return PassOn(AtLens(config, device.error()));
  if (!device->camera) {
    const drivers::LeftOut* why = device->findings.Of("camera");
    const Error error{why != nullptr ? why->code : Code::BadData,
                      camera.settings.where().Text() + ": lens \"" + config.name + "\": this device has no camera" +
                          (why != nullptr ? " that can be used: " + why->reason : "")};
    return PassOn(error);
  }
  OpenedCamera opened{std::move(device->camera), HalfOf(device->findings, false)};
  if (auto unnamed = RefuseNamed(config, camera.settings, opened.findings); !unnamed) return PassOn(unnamed);
  return opened;
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
  // Pictures come from the camera that [lens.camera] names, whatever the lens' own device has.
  if (config.camera) device->findings = HalfOf(device->findings, true);
  if (auto unnamed = RefuseNamed(config, config.table, device->findings); !unnamed) return PassOn(unnamed);
  if (!device->lens) return PassOn(AtLens(config, {Code::Unsupported, "this device has no lens"}));
  if (auto missing = RefuseMissing(config, device->lens->capabilities()); !missing) return PassOn(missing);
  if (!config.camera) return device;
  if (device->camera) {
    const std::string place = config.camera->settings.where().Text();
    return Fail(Code::BadData, place + ": the lens' own driver brings a camera already; remove [lens.camera]");
  }
  auto camera = OpenCamera(config, clock, signal);
  if (!camera) return PassOn(camera);
  device->camera = std::move(camera->camera);
  device->findings.Add(camera->findings);
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
