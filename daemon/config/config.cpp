// Reads and checks lensd.toml and its drop-ins; every mistake is told with file and line.
#include "daemon/config/config.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <system_error>
#include <type_traits>
#include <utility>
#include <variant>

#include "base/settings_problems.h"
#include "daemon/config/config_faults.h"
#include "daemon/config/drivers_table.h"
#include "daemon/config/lens_models.h"
#include "daemon/config/references.h"
#include "io/lenient_toml.h"
#include "rig/presets.h"

namespace lensd::daemon {
namespace {

/// Keys of [[lens]] that are not the driver's.
constexpr std::array<std::string_view, 15> kOwnKeys = {
    "name",   "driver", "start", "distance_from", "optics",     "focus",   "iris",   "zoom",
    "filter", "camera", "bus",   "temperature",   "on_failure", "refocus", "process"};
/// Of these keys none is needed to open a lens.
constexpr std::array<std::string_view, 1> kBesideTheLens = {"on_failure"};

bool IsLensName(std::string_view name) {
  const auto letter = [](char c) { return c >= 'a' && c <= 'z'; };
  const auto rest = [&](char c) { return letter(c) || (c >= '0' && c <= '9') || c == '-'; };
  return !name.empty() && letter(name[0]) && std::ranges::all_of(name, rest);
}

/// Names stand where commands also take an axis or a quantity.
std::string WhyNotAName(std::string_view name) {
  if (!IsLensName(name)) return "a name has small letters, digits and -, and begins with a letter";
  if (drivers::AxisFromName(name)) return "a lens cannot be named like an axis";
  if (name == "inf" || name == "infinity") return "a lens cannot be named like a quantity";
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
  if (read.Choice("process", {"inside", "own"}, 0) == 1) device.process = std::make_shared<std::atomic<int>>(0);
  if (device.process && device.driver != nullptr && device.driver->simulated) {
    read.Reject("process", "is of drivers of real hardware: the simulator always runs inside lensd");
  }
  if (device.driver == nullptr) {
    if (!name.empty()) read.Reject("driver", WhyNoDriver(name));
    LeaveDriversKeys(read, device.settings, own_keys);
    return device;
  }
  // The driver knows its own keys and refuses the others when it opens the device.
  for (const auto& [key, unused] : *device.settings.AsTable()) read.Any(key);
  return device;
}

Result<DeviceConfig> ReadCamera(const Settings& table) {
  SettingsReader read(table, "[lens.camera]");
  constexpr std::array<std::string_view, 2> kCameraKeys = {"driver", "process"};
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

/// A program, or a program and its arguments. Its path is relative to the file it is written in.
std::vector<std::string> ReadCommand(SettingsReader& read, std::string_view key) {
  const Settings* given = read.Any(key);
  if (given == nullptr) return {};
  std::vector<std::string> words;
  const auto add = [&](const Settings& word) {
    const auto* text = std::get_if<std::string>(&word.value());
    if (text != nullptr) words.push_back(*text);
    return text != nullptr;
  };
  const Settings::Array* array = given->AsArray();
  const bool texts = array == nullptr ? add(*given) : std::ranges::all_of(*array, add);
  if (!texts || words.empty() || words.front().empty()) {
    read.Reject(key, "must be the path of a program, or an array of this path and its arguments; no shell is used");
    return {};
  }
  words.front() = (std::filesystem::path(given->where().file).parent_path() / words.front()).string();
  return words;
}

/// Whether it hangs on a bus whose own mistakes are told where it is written.
bool OnFaultyBus(const Settings* bus, const ConfigFaults& faults) {
  const auto* name = bus == nullptr ? nullptr : std::get_if<std::string>(&bus->value());
  return name != nullptr && std::ranges::find(faults.buses, *name) != faults.buses.end();
}

/// What is wrong is kept, and the lens read on.
class LensReading {
 public:
  LensReading(const Settings& table, const Buses& buses, ConfigFaults& faults)
      : table_(table), buses_(buses), faults_(faults), read_(table, "[[lens]]") {}

  LensConfig Read() {
    LensConfig lens;
    lens.where = table_.where();
    lens.table = table_;
    lens.name = read_.RequiredText("name");
    const Settings* name = read_.Any("name");
    const bool is_text = name != nullptr && std::holds_alternative<std::string>(name->value());
    if (const std::string why = WhyNotAName(lens.name); is_text && !why.empty()) read_.Reject("name", why);
    lens.device = ReadDevice(read_, table_, kOwnKeys);
    const bool on_demand = ReadStart(lens);
    const Settings* bus = read_.Any("bus");
    const bool simulated = lens.device.driver != nullptr && lens.device.driver->simulated;
    const auto nominal = simulated ? rig::NominalFrom::Driver : rig::NominalFrom::Configuration;
    if (auto rig = rig::ReadRigConfig(read_, nominal); Good(rig)) lens.rig = *std::move(rig);
    for (const drivers::Axis axis : drivers::kAxes) lens.rig.axes[axis].home_on_demand = on_demand;
    const Settings* camera = read_.Table("camera");
    lens.on_failure = ReadCommand(read_, "on_failure");
    Good(read_.Finish());
    lens.device.lens = lens.name;
    PutReferences(lens.device, bus);
    if (camera != nullptr) AddCamera(*camera, lens);
    lens.files = MarksOfFilesIn(Without(table_, kBesideTheLens));
    std::erase_if(lens.files, [&](const FileMark& mark) { return mark.path == lens.rig.calibration_path; });
    if (!sound_) faults_.lenses.push_back(lens.where);
    return lens;
  }

 private:
  template <class T>
  bool Good(const Result<T>& read) {
    if (!read) faults_.Keep(read.error(), table_.where());
    sound_ = sound_ && read.has_value();
    return read.has_value();
  }

  /// Where the lens goes at the start. The answer: whether it searches its reference on demand.
  bool ReadStart(LensConfig& lens) {
    constexpr std::string_view kPreset = "preset:";
    const Settings* given = read_.Any("start");
    const auto* text = given == nullptr ? nullptr : std::get_if<std::string>(&given->value());
    if (text != nullptr && text->starts_with(kPreset)) {
      lens.start_preset = text->substr(kPreset.size());
      if (!rig::IsPresetLabel(lens.start_preset))
        read_.Reject("start", "must name a preset after \"preset:\", as in \"preset:desk\"");
      return false;
    }
    const std::size_t start = read_.Choice("start", {"keep", "home", "on-demand", "last", "preset:NAME"}, 0);
    lens.home_at_start = start == 1;
    lens.start_last = start == 3;
    return start == 2;
  }

  void PutReferences(DeviceConfig& device, const Settings* bus) {
    if (device.driver == nullptr) return;
    if (OnFaultyBus(bus, faults_) || !Good(Resolve(device, bus, buses_))) device.driver = nullptr;
    const auto* name = bus == nullptr ? nullptr : std::get_if<std::string>(&bus->value());
    if (name != nullptr) device.shares = "bus " + *name;
  }

  void AddCamera(const Settings& table, LensConfig& lens) {
    auto camera = ReadCamera(table);
    if (!Good(camera)) return;
    lens.camera = *std::move(camera);
    lens.camera->lens = lens.name;
  }

  const Settings& table_;
  const Buses& buses_;
  ConfigFaults& faults_;
  SettingsReader read_;
  bool sound_ = true;
};

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

/// A bus has one master: its lenses are inside lensd, or together in one process.
void CheckProcessOfBus(const LensConfig& lens, const Config& config, ConfigFaults& faults) {
  const auto differs = [&](const LensConfig& other) {
    return other.device.shares == lens.device.shares &&
           (other.device.process == nullptr) != (lens.device.process == nullptr);
  };
  const auto other = std::ranges::find_if(config.lenses, differs);
  if (lens.device.shares.empty() || other == config.lenses.end()) return;
  const auto word = [](const LensConfig& one) { return one.device.process ? "\"own\"" : "\"inside\""; };
  const auto place = lens.table.AsTable()->find("process");
  const Location& where = place == lens.table.AsTable()->end() ? lens.where : place->second.where();
  faults.Keep({Code::BadData, where.Text() + ": lenses on one bus have the same process: lens \"" + lens.name +
                                  "\" has " + word(lens) + ", and lens \"" + other->name + "\" on this bus has " +
                                  word(*other)});
  faults.lenses.push_back(lens.where);
}

void AddLens(const Settings& written, Config& config, ConfigFaults& faults) {
  const auto resolved = WithLensModel(written);
  if (!resolved) {
    faults.Keep(resolved.error(), written.where());
    faults.lenses.push_back(written.where());
  }
  constexpr std::array<std::string_view, 1> kOptics = {"optics"};
  const Settings table = resolved ? *resolved : Without(written, kOptics);
  LensConfig lens = LensReading(table, config.buses, faults).Read();
  const bool twice = !lens.name.empty() && std::ranges::count(config.lenses, lens.name, &LensConfig::name) > 0;
  if (twice) faults.Keep({Code::BadData, lens.where.Text() + ": there is another lens \"" + lens.name + "\""});
  CheckProcessOfBus(lens, config, faults);
  config.lenses.push_back(std::move(lens));
}

/// Tables that belong to a lens, written as if they stood alone.
void RejectTablesOfALens(SettingsReader& read) {
  constexpr std::array<std::string_view, 8> kTables = {"optics", "focus",  "iris",        "zoom",
                                                       "filter", "camera", "temperature", "refocus"};
  for (const std::string_view table : kTables) {
    if (!read.Has(table)) continue;
    read.Any(table);
    read.Reject(table, "belongs to a lens: write [lens." + std::string(table) + "], below its [[lens]]");
  }
}

void AddTables(const Settings& file, Config& config, ConfigFaults& faults) {
  SettingsReader read(file, "the configuration");
  if (!read.Has("version")) read.Reject("version", "is missing: write version = 1 as the first line of the file");
  if (read.Integer("version", 1) != 1) read.Reject("version", "must be 1: this lensd reads version 1 alone");
  const std::vector<const Settings*> buses = read.Tables("bus");
  const std::vector<const Settings*> lenses = read.Tables("lens");
  const Settings* access = read.Table("access");
  RejectTablesOfALens(read);
  if (auto done = read.Finish(); !done) faults.Keep(done.error());
  if (access != nullptr) {
    auto read_access = ReadAccess(*access);
    if (!read_access) faults.Keep(read_access.error());
    if (read_access) config.access = *std::move(read_access);
  }
  for (const Settings* table : buses) {
    const auto added = AddBus(*table, config.buses);
    if (added) continue;
    faults.Keep(added.error(), table->where());
    const auto name = table->AsTable()->find("name");
    const auto* text = name == table->AsTable()->end() ? nullptr : std::get_if<std::string>(&name->second.value());
    if (text != nullptr) faults.buses.push_back(*text);
  }
  for (const Settings* table : lenses) AddLens(*table, config, faults);
}

void AddFile(const std::string& path, Config& config, ConfigFaults& faults) {
  faults.files.push_back(path);
  io::LenientToml file = io::ReadTomlLeniently(path);
  for (const Error& fault : file.faults) {
    const bool last = &fault == &file.faults.back();
    faults.Keep({fault.code, fault.message + (last && !file.whole && fault.code == Code::BadData
                                                  ? "; the rest of the file was not checked"
                                                  : "")},
                {path, 0});
    if (auto* problems = SettingsProblems::Current()) faults.no_toml.push_back(problems->all().back().where);
  }
  if (file.whole) AddTables(file.settings, config, faults);
}

std::string& NamedFile() {
  static std::string path;
  return path;
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
  return one.where.file == other.where.file &&
         SameValues(Without(one.table, kBesideTheLens), Without(other.table, kBesideTheLens)) &&
         SameValues(one.device.settings, other.device.settings) && one.files == other.files;
}

std::string ChangedFile(const LensConfig& one, const LensConfig& other) {
  for (const FileMark& mark : one.files) {
    const auto now = std::ranges::find(other.files, mark.path, &FileMark::path);
    if (now != other.files.end() && *now != mark) return mark.path;
  }
  return "";
}

void ConfigFaults::Keep(const Error& error, const Location& otherwise) {
  if (first) first = PassOn(error);
  if (auto* problems = SettingsProblems::Current()) problems->Add(error.message, otherwise);
}

std::span<const std::string_view> OwnLensKeys() {
  return kOwnKeys;
}

void NameConfiguration(const std::string& path) {
  std::error_code none;
  NamedFile() = std::filesystem::absolute(path, none).string();
}

const std::string& NamedConfiguration() {
  return NamedFile();
}

Config ReadPastFaults(const std::string& path, ConfigFaults& faults) {
  Config config;
  std::error_code none;
  const bool drop_ins_alone = path == kUsualConfig && !std::filesystem::exists(path, none) && !none;
  if (!drop_ins_alone) AddFile(path, config, faults);
  const auto drop_ins = DropIns(path);
  if (!drop_ins) faults.Keep(drop_ins.error(), {path, 0});
  for (const std::string& drop_in : drop_ins ? *drop_ins : std::vector<std::string>()) {
    AddFile(drop_in, config, faults);
  }
  return config;
}

Result<Config> ReadConfig(const std::string& path) {
  ConfigFaults faults;
  Config config = ReadPastFaults(path, faults);
  if (!faults.first) return PassOn(faults.first);
  return config;
}

}  // namespace lensd::daemon
