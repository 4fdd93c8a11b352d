// Reads and checks lensd.toml and its drop-ins; every mistake is told with file and line.
#include "config.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <system_error>
#include <type_traits>
#include <utility>
#include <variant>

#include "drivers_table.h"
#include "io/toml.h"
#include "references.h"

namespace lensd::daemon {
namespace {

/// Keys of [[lens]] that are not the driver's.
constexpr std::array<std::string_view, 12> kOwnKeys = {"name",   "driver", "start", "distance_from",
                                                       "optics", "focus",  "iris",  "zoom",
                                                       "filter", "camera", "bus",   "temperature"};

bool IsLensName(std::string_view name) {
  const auto letter = [](char c) { return c >= 'a' && c <= 'z'; };
  const auto rest = [&](char c) { return letter(c) || (c >= '0' && c <= '9') || c == '-'; };
  return !name.empty() && letter(name[0]) && std::ranges::all_of(name, rest);
}

/// Names stand where commands also take an axis or a quantity.
std::string WhyNotAName(std::string_view name) {
  if (!IsLensName(name)) return "a name has small letters, digits and -, and begins with a letter";
  if (drivers::AxisFromName(name)) return "a lens cannot be named like an axis";
  if (name == "inf") return "a lens cannot be named like a quantity";
  return "";
}

/// Whether two say the same, wherever they were written.
bool SameValues(const Settings& one, const Settings& other) {
  if (const auto* table = one.AsTable()) {
    return other.AsTable() != nullptr && std::ranges::equal(*table, *other.AsTable(), [](const auto& a, const auto& b) {
             return a.first == b.first && SameValues(a.second, b.second);
           });
  }
  if (const auto* array = one.AsArray()) {
    return other.AsArray() != nullptr && std::ranges::equal(*array, *other.AsArray(), SameValues);
  }
  return std::visit(
      [&](const auto& value) {
        using Scalar = std::decay_t<decltype(value)>;
        if constexpr (std::is_same_v<Scalar, Settings::Table> || std::is_same_v<Scalar, Settings::Array>)
          return false;
        else {
          const auto* theirs = std::get_if<Scalar>(&other.value());
          return theirs != nullptr && *theirs == value;
        }
      },
      one.value());
}

/// The table without the keys in `taken`.
Settings Without(const Settings& table, std::span<const std::string_view> taken) {
  Settings::Table rest;
  for (const auto& [key, value] : *table.AsTable()) {
    if (std::ranges::find(taken, key) == taken.end()) rest.emplace(key, value);
  }
  Settings::Value value(std::in_place_type<Settings::Table>, std::move(rest));
  return Settings(std::move(value), table.where());
}

DeviceConfig ReadDevice(SettingsReader& read, const Settings& table, std::span<const std::string_view> own_keys) {
  const std::string name = read.RequiredText("driver");
  DeviceConfig device{FindDriver(name), Without(table, own_keys)};
  if (device.driver == nullptr) {
    read.Reject("driver", "there is no driver \"" + name + "\" in this build; it has " + DriverNames());
  }
  // The driver knows its own keys and refuses the others when it opens the device.
  for (const auto& [key, unused] : *device.settings.AsTable()) read.Any(key);
  return device;
}

Result<DeviceConfig> ReadCamera(const Settings& table) {
  SettingsReader read(table, "[lens.camera]");
  constexpr std::array<std::string_view, 1> kCameraKeys = {"driver"};
  DeviceConfig camera = ReadDevice(read, table, kCameraKeys);
  if (auto done = read.Finish(); !done) return PassOn(done);
  return camera;
}

/// Puts what the settings refer to in place of its names.
Result<void> Resolve(DeviceConfig& device, const Settings* bus, const Buses& buses) {
  auto settings = WithProfiles(device.settings, *device.driver);
  if (settings && bus != nullptr) settings = WithBus(*settings, *bus, *device.driver, buses);
  if (!settings) return PassOn(settings);
  device.settings = *std::move(settings);
  return {};
}

Result<LensConfig> ReadLens(const Settings& table, const Buses& buses) {
  SettingsReader read(table, "[[lens]]");
  LensConfig lens;
  lens.where = table.where();
  lens.table = table;
  lens.name = read.RequiredText("name");
  if (const std::string why = WhyNotAName(lens.name); !why.empty()) read.Reject("name", why);
  lens.device = ReadDevice(read, table, kOwnKeys);
  const std::size_t start = read.Choice("start", {"keep", "home", "on-demand"}, 0);
  lens.home_at_start = start == 1;
  const Settings* bus = read.Any("bus");
  const bool simulated = lens.device.driver != nullptr && lens.device.driver->simulated;
  auto rig = rig::ReadRigConfig(read, simulated ? rig::NominalFrom::Driver : rig::NominalFrom::Configuration);
  if (!rig) return PassOn(rig);
  lens.rig = *std::move(rig);
  for (const drivers::Axis axis : drivers::kAxes) lens.rig.axes[axis].home_on_demand = start == 2;
  const Settings* camera = read.Table("camera");
  if (auto done = read.Finish(); !done) return PassOn(done);
  if (auto resolved = Resolve(lens.device, bus, buses); !resolved) return PassOn(resolved);
  if (camera != nullptr) {
    auto read_camera = ReadCamera(*camera);
    if (!read_camera) return PassOn(read_camera);
    lens.camera = *std::move(read_camera);
  }
  return lens;
}

std::vector<std::string> ReadGroups(SettingsReader& read, std::string_view key, std::vector<std::string> fallback) {
  const Settings* given = read.Any(key);
  if (given == nullptr) return fallback;
  const Settings::Array* array = given->AsArray();
  std::vector<std::string> names;
  for (const Settings& name : array == nullptr ? Settings::Array{} : *array) {
    if (const auto* text = std::get_if<std::string>(&name.value()); text != nullptr && !text->empty()) {
      names.push_back(*text);
    }
  }
  if (array == nullptr || names.size() != array->size()) {
    read.Reject(key, "must be an array of names of groups, as [\"lens\"]; [] gives the role to no group");
  }
  return names;
}

Result<AccessConfig> ReadAccess(const Settings& table) {
  SettingsReader read(table, "[access]");
  AccessConfig access;
  access.move = ReadGroups(read, "move", access.move);
  access.administer = ReadGroups(read, "administer", access.administer);
  if (auto done = read.Finish(); !done) return PassOn(done);
  return access;
}

Result<void> AddFile(const std::string& path, Config& config) {
  Result<Settings> file = io::ReadTomlFile(path);
  if (!file) return PassOn(file);
  SettingsReader read(*file, "the configuration");
  if (!read.Has("version")) read.Reject("version", "the file must say version = 1");
  if (read.Integer("version", 1) != 1) read.Reject("version", "this lensd reads version 1");
  const std::vector<const Settings*> buses = read.Tables("bus");
  const std::vector<const Settings*> lenses = read.Tables("lens");
  const Settings* access = read.Table("access");
  if (auto done = read.Finish(); !done) return done;
  if (access != nullptr) {
    auto read_access = ReadAccess(*access);
    if (!read_access) return PassOn(read_access);
    config.access = *std::move(read_access);
  }
  for (const Settings* table : buses) {
    if (auto added = AddBus(*table, config.buses); !added) return added;
  }
  for (const Settings* table : lenses) {
    Result<LensConfig> lens = ReadLens(*table, config.buses);
    if (!lens) return PassOn(lens);
    if (std::ranges::find(config.lenses, lens->name, &LensConfig::name) != config.lenses.end()) {
      return Fail(Code::BadData, lens->where.Text() + ": there is another lens \"" + lens->name + "\"");
    }
    config.lenses.push_back(*std::move(lens));
  }
  return {};
}

Result<std::vector<std::string>> DropIns(const std::string& path) {
  std::vector<std::string> found;
  std::error_code error;
  const std::filesystem::path folder = path + ".d";
  if (!std::filesystem::is_directory(folder, error)) return found;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (entry.path().extension() == ".toml") found.push_back(entry.path().string());
  }
  if (error) return Fail(Code::Io, folder.string() + ": " + error.message());
  std::ranges::sort(found);
  return found;
}

}  // namespace

bool SameLens(const LensConfig& one, const LensConfig& other) {
  // The table names a bus and profiles; the device's settings say what stands there.
  return one.where.file == other.where.file && SameValues(one.table, other.table) &&
         SameValues(one.device.settings, other.device.settings);
}

Result<Config> ReadConfig(const std::string& path) {
  Config config;
  if (auto added = AddFile(path, config); !added) return PassOn(added);
  const auto drop_ins = DropIns(path);
  if (!drop_ins) return Fail(drop_ins.error().code, drop_ins.error().message);
  for (const std::string& drop_in : *drop_ins) {
    if (auto added = AddFile(drop_in, config); !added) return PassOn(added);
  }
  return config;
}

}  // namespace lensd::daemon
