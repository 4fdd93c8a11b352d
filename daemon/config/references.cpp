// What a device's settings refer to by name (profiles, buses) put in its place before a driver sees them.
#include "daemon/config/references.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <utility>
#include <vector>

#include "base/nearest_word.h"
#include "daemon/config/config_faults.h"
#include "daemon/config/drivers_table.h"
#include "io/toml.h"

namespace lensd::daemon {
namespace {

std::unexpected<Error> BadReference(const Settings& at, const std::string& why) {
  return Fail(Code::BadData, at.where().Text() + ": " + why);
}

Result<Settings> Profile(const Settings& named, const std::string& name, const drivers::Profiles& profiles) {
  if (!name.ends_with(".toml")) {
    const std::string_view text = profiles.text(name);
    if (!text.empty()) return io::ParseToml(text, "profile " + name);
    return BadReference(named, "there is no profile \"" + name + "\"; there is " + std::string(profiles.names()) +
                                   ", and any file whose name ends in .toml");
  }
  const std::filesystem::path folder = std::filesystem::path(named.where().file).parent_path();
  auto read = io::ReadTomlFile((folder / name).lexically_normal().string());
  if (!read && read.error().code == Code::Io) return BadReference(named, "profile " + read.error().message);
  return read;
}

}  // namespace

/// Which driver is for what its users call by the name of a standard, a bus or a maker; empty where that is not known.
std::string_view DriverOfStandard(std::string_view name) {
  static constexpr std::pair<std::string_view, std::string_view> kByStandard[] = {
      {"gige", "aravis"},       {"gigevision", "aravis"}, {"gev", "aravis"},        {"genicam", "aravis"},
      {"u3v", "aravis"},        {"usb3", "aravis"},       {"usb3vision", "aravis"}, {"webcam", "v4l2"},
      {"video", "v4l2"},        {"v4l", "v4l2"},          {"usb", "uvc"},           {"rs485", "modbus"},
      {"modbus-rtu", "modbus"}, {"modbus-tcp", "modbus"}, {"simulator", "sim"},     {"simulated", "sim"}};
  const auto* found = std::ranges::find(kByStandard, name, &std::pair<std::string_view, std::string_view>::first);
  return found != std::end(kByStandard) && FindDriver(found->second) != nullptr ? found->second : std::string_view();
}

std::string WhyNoDriver(const std::string& name) {
  std::vector<std::string> words;
  for (const drivers::Driver& driver : Drivers()) words.emplace_back(driver.name);
  auto meant = NearestWord(name, words);
  if (const std::string_view other = DriverOfStandard(name); !other.empty()) meant = other;
  return "there is no driver \"" + name + "\" in this build; it has " + DriverNames() +
         (meant ? "; did you mean \"" + *meant + "\"?" : "");
}

void LeaveDriversKeys(SettingsReader& read, const Settings& table, std::span<const std::string_view> own_keys) {
  const std::vector<std::string> words(own_keys.begin(), own_keys.end());
  for (const auto& [key, unused] : *table.AsTable()) {
    if (!NearestWord(key, words)) read.Any(key);
  }
}

Result<void> AddBus(const Settings& table, Buses& buses) {
  constexpr std::array<std::string_view, 2> kBusKeys = {"name", "driver"};
  SettingsReader read(table, "[[bus]]");
  const std::string name = read.RequiredText("name");
  const std::string driver_name = read.RequiredText("driver");
  const drivers::Driver* driver = FindDriver(driver_name);
  if (driver == nullptr) {
    read.Reject("driver", WhyNoDriver(driver_name));
    LeaveDriversKeys(read, table, kBusKeys);
  } else if (driver->check_bus == nullptr) {
    read.Reject("driver", driver_name + " has no buses");
  }
  if (buses.contains(name)) read.Reject("name", "there is another bus \"" + name + "\"");
  if (driver != nullptr) {
    for (const auto& [key, unused] : *table.AsTable()) read.Any(key);  // the driver knows its own keys
  }
  const auto done = read.Finish();
  Result<void> checked;
  if (driver != nullptr && driver->check_bus != nullptr) checked = driver->check_bus(table);
  if (!done) return done;
  if (!checked) return checked;
  buses.emplace(name, BusEntry{driver, table});
  return {};
}

Result<Settings> WithProfiles(const Settings& settings, const drivers::Driver& driver) {
  const Settings::Table* table = settings.AsTable();
  if (driver.profiles == nullptr || table == nullptr) return settings;
  Settings::Table done;
  for (const auto& [key, value] : *table) {
    const auto* name = std::get_if<std::string>(&value.value());
    auto replaced =
        key == "profile" && name != nullptr ? Profile(value, *name, *driver.profiles) : WithProfiles(value, driver);
    if (!replaced) return replaced;
    done.emplace(key, *std::move(replaced));
  }
  return Settings(Settings::Value(std::in_place_type<Settings::Table>, std::move(done)), settings.where());
}

Result<Settings> WithBus(const Settings& settings, const Settings& name, const drivers::Driver& driver,
                         const Buses& buses) {
  const auto* text = std::get_if<std::string>(&name.value());
  if (text == nullptr) return BadReference(name, "[[lens]] bus must be a string, the name of a [[bus]]");
  if (driver.check_bus == nullptr) {
    return BadReference(name, "[[lens]] bus: driver \"" + std::string(driver.name) + "\" has no buses");
  }
  const auto found = buses.find(*text);
  if (found == buses.end()) return BadReference(name, "[[lens]] bus: there is no [[bus]] named \"" + *text + "\"");
  if (found->second.driver != &driver) {
    return BadReference(
        name, "[[lens]] bus: \"" + *text + "\" is a bus of driver " + std::string(found->second.driver->name));
  }
  Settings::Table with = *settings.AsTable();
  with.insert_or_assign("bus", found->second.settings);
  return Settings(Settings::Value(std::in_place_type<Settings::Table>, std::move(with)), settings.where());
}

}  // namespace lensd::daemon
