// Opens a lens made of drives on one bus. Buses are shared between lenses by their endpoint; drives are greeted by what
// their profile says of them.
#include "drivers/modbus/driver.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>

#include "bus.h"
#include "modbus_lens.h"

namespace lensd::drivers::modbus {
namespace {

using drivers::Axis;

constexpr int kOpenAttempts = 3;
constexpr Duration kBusyOpening = std::chrono::seconds(2);       ///< so long a busy drive is asked again
constexpr Duration kGreetPause = std::chrono::milliseconds(20);  ///< before that
/// The keys of a drive that ReadOverrides() reads.
constexpr std::string_view kOverrides[] = {"parameters",     "word_order", "homing",    "feedback",
                                           "position_scale", "scale",      "settle_ms", "counts_per_revolution"};

struct LensSettings {
  BusConfig bus;
  std::vector<DriveConfig> drives;
  Location where;
};

/// The parameters of the profile that an axis sets otherwise.
Result<void> SetParameters(const Settings& table, Profile& profile) {
  for (const auto& [key, value] : *table.AsTable()) {
    const auto known = profile.parameters.find(key);
    const auto* number = std::get_if<std::int64_t>(&value.value());
    if (known != profile.parameters.end() && number != nullptr) {
      known->second = *number;
      continue;
    }
    std::string names;
    for (const auto& [name, unused] : profile.parameters) names += (names.empty() ? "" : ", ") + name;
    return Fail(Code::BadData, value.where().Text() + ": parameters of this profile are " + names + ", whole numbers");
  }
  return {};
}

double SpeedOf(const Profile& profile, double counts_per_revolution) {
  if (profile.speed_parameter.empty()) return 0.0;
  const double of_one = profile.speed_counts_per_s + profile.speed_revolutions_per_s * counts_per_revolution;
  return std::abs(of_one * static_cast<double>(profile.parameters.at(profile.speed_parameter)));
}

Result<void> ReadOverrides(SettingsReader& read, DriveConfig& drive) {
  Profile& profile = drive.profile;
  if (const Settings* parameters = read.Table("parameters")) {
    if (auto set = SetParameters(*parameters, profile); !set) return set;
  }
  if (read.Any("word_order") != nullptr) {
    profile.word_order =
        read.Choice("word_order", {"high-first", "low-first"}, 0) == 0 ? WordOrder::HighFirst : WordOrder::LowFirst;
  }
  if (read.Any("homing") != nullptr)
    profile.homing_required = read.Choice("homing", {"not-needed", "required"}, 0) == 1;
  if (profile.homing_required && profile.home.empty())
    read.Reject("homing", "is required, and the profile cannot home");
  profile.feedback = ReadFeedback(read, profile.feedback);
  profile.position_scale = read.Number("position_scale", profile.position_scale);
  if (profile.position_scale == 0.0) read.Reject("position_scale", "must not be 0");
  drive.scale = read.Number("scale", 1.0);
  if (drive.scale == 0.0) read.Reject("scale", "must not be 0");
  drive.speed = std::abs(drive.scale) * SpeedOf(profile, read.Number("counts_per_revolution", 0.0, kNonNegative));
  const double settle_ms = read.Number("settle_ms", 0.0, {0.0, 60e3});
  drive.settle = std::chrono::microseconds(std::llround(settle_ms * 1e3));
  return {};
}

std::string_view TypeName(NumberType type) {
  constexpr std::string_view kNames[] = {"u16", "s16", "u32", "s32"};
  return kNames[static_cast<std::size_t>(type)];
}

/// What a register cannot hold wraps round in it: the ends of the range must fit where they are read and written.
void CheckWidths(SettingsReader& read, const DriveConfig& drive) {
  const Profile& profile = drive.profile;
  const auto fits = [&](NumberType type, double native, double of_one) {
    const double number = std::round(native / of_one);
    return std::abs(number) < 1e15 && Fits(type, static_cast<std::int64_t>(number));
  };
  const auto check = [&](NumberType type, double of_one, const std::string& what) {
    if (fits(type, drive.low, of_one) && fits(type, drive.high, of_one)) return true;
    read.Reject("range", "does not fit into the drive's " + what + ", " + std::string(TypeName(type)) +
                             " by its profile: correct the range, or the type");
    return false;
  };
  if (!check(profile.position.type, drive.scale * profile.position_scale, "position")) return;
  for (const WriteStep& step : profile.move) {
    for (const Field& field : step.fields) {
      if (field.name == "target" && !check(field.type, drive.scale, "target")) return;
    }
  }
}

/// One table of `drives`.
Result<DriveConfig> ReadDrive(const Settings& table, Axis axis) {
  const std::string what = "[lens.drives." + std::string(AxisName(axis)) + "]";
  SettingsReader read(table, what);
  DriveConfig drive;
  drive.axis = axis;
  drive.unit = static_cast<int>(read.Integer("unit", 0, {1, 247}));
  if (drive.unit == 0) read.Reject("unit", "is missing: the drive's number on its bus, from 1 to 247");
  const auto range = read.OptionalNumbers("range", 2, {-2147483648.0 * 1e3, 2147483647.0 * 1e3});
  if (!range) read.Reject("range", "must be the lowest and the highest position, as in [0, 20000]");
  if (range && (*range)[0] >= (*range)[1]) read.Reject("range", "must have its smaller number first");
  if (range) std::tie(drive.low, drive.high) = std::pair((*range)[0], (*range)[1]);
  const Settings* profile = read.Table("profile");
  if (profile == nullptr)
    read.Reject("profile", "is missing: one of " + std::string(ShippedProfileNames()) + ", or a file");
  if (profile != nullptr) {
    auto known = ReadProfile(*profile);
    if (!known) {  // what changes it cannot be judged; the table's own mistakes are told all the same
      for (const std::string_view key : kOverrides) read.Any(key);
      (void)read.Finish();
      return PassOn(known);
    }
    drive.profile = *std::move(known);
  }
  if (auto overrides = ReadOverrides(read, drive); !overrides) return PassOn(overrides);
  if (range) CheckWidths(read, drive);
  if (auto done = read.Finish(); !done) return PassOn(done);
  return drive;
}

Result<std::vector<DriveConfig>> ReadDrives(const Settings& table) {
  SettingsReader read(table, "[lens.drives]");
  std::vector<DriveConfig> drives;
  Result<void> first;  // that failed; the others are read too, and tell their own mistakes
  for (const Axis axis : drivers::kAxes) {
    const Settings* own = read.Table(AxisName(axis));
    if (own == nullptr) continue;
    auto drive = ReadDrive(*own, axis);
    if (!drive && first) first = PassOn(drive);
    if (!drive) continue;
    for (const DriveConfig& other : drives) {
      if (other.unit == drive->unit) {
        return Fail(Code::BadData, own->where().Text() + ": unit " + std::to_string(drive->unit) + " turns " +
                                       std::string(AxisName(other.axis)) + " already");
      }
    }
    drives.push_back(*std::move(drive));
  }
  const auto done = read.Finish();
  if (!first) return PassOn(first);
  if (!done) return PassOn(done);
  if (drives.empty()) return Fail(Code::BadData, table.where().Text() + ": no axis has a drive");
  return drives;
}

Result<LensSettings> ReadSettings(const Settings& settings) {
  SettingsReader read(settings, "driver \"modbus\"");
  LensSettings lens;
  lens.where = settings.where();
  const Settings* bus = read.Table("bus");
  if (bus == nullptr) read.Reject("bus", "is missing: the name of a [[bus]]");
  const Settings* drives = read.Table("drives");
  if (drives == nullptr) read.Reject("drives", "is missing: [lens.drives.focus] with unit, profile and range");
  if (auto done = read.Finish(); !done) return PassOn(done);
  auto bus_config = ReadBusConfig(*bus);
  if (!bus_config) return PassOn(bus_config);
  lens.bus = *std::move(bus_config);
  auto read_drives = ReadDrives(*drives);
  if (!read_drives) return PassOn(read_drives);
  lens.drives = *std::move(read_drives);
  return lens;
}

/// What the bus says, else what all of these drives leave the factory with.
Result<std::optional<char>> ParityOf(const LensSettings& lens) {
  std::optional<char> parity = lens.bus.parity;
  if (parity || !lens.bus.serial()) return parity;
  for (const DriveConfig& drive : lens.drives) {
    if (parity && drive.profile.parity && parity != drive.profile.parity) {
      return Fail(Code::BadData, lens.bus.where.Text() + ": the drives on bus " + lens.bus.name +
                                     " differ in parity by their profiles: set the drives alike, and say parity here");
    }
    if (drive.profile.parity) parity = drive.profile.parity;
  }
  return parity;
}

/// The buses in use: lenses that name the same one share it.
class BusesInUse {
 public:
  Result<std::shared_ptr<Bus>> Open(const LensSettings& lens) {
    const auto parity = ParityOf(lens);
    if (!parity) return PassOn(parity);
    const std::lock_guard lock(mutex_);
    std::weak_ptr<Bus>& known = buses_[lens.bus.Endpoint()];
    if (auto bus = known.lock()) {
      const bool same_parity = !*parity || !lens.bus.serial() || **parity == bus->parity();
      if (bus->config().name == lens.bus.name && bus->config().where.Text() == lens.bus.where.Text() && same_parity)
        return bus;
      return Fail(Code::BadData, lens.bus.where.Text() + ": " + lens.bus.Endpoint() + " is in use already as bus " +
                                     bus->config().name + (same_parity ? "" : " with another parity"));
    }
    auto bus = std::make_shared<Bus>(lens.bus, parity->value_or('N'));
    known = bus;
    return bus;
  }

 private:
  std::mutex mutex_;
  std::map<std::string, std::weak_ptr<Bus>> buses_;
};

BusesInUse& Buses() {
  static BusesInUse buses;
  return buses;
}

/// A drive that is not there, or is another than it is said to be, is found out now.
Result<void> Greet(drivers::Lens& lens, const Clock& clock) {
  Result<drivers::LensState> read;
  const Instant give_up = clock.Now() + kBusyOpening;
  for (int attempt = 0; attempt < kOpenAttempts;) {
    read = lens.Read();
    if (read) return {};
    if (read.error().code == Code::Disconnected) break;
    if (read.error().code == Code::Busy && clock.Now() < give_up) {
      std::this_thread::sleep_for(kGreetPause);
    } else {
      ++attempt;
    }
  }
  const bool silent = read.error().code == Code::Timeout || read.error().code == Code::Busy;
  return Fail(silent ? Code::Disconnected : read.error().code, read.error().message);
}

}  // namespace

Result<void> CheckModbus(const Settings& settings) {
  const auto config = ReadSettings(settings);
  if (!config) return PassOn(config);
  return {};
}

Result<drivers::Device> OpenModbus(const Settings& settings, const Clock& clock) {
  auto lens = ReadSettings(settings);
  if (!lens) return PassOn(lens);
  auto bus = Buses().Open(*lens);
  if (!bus) return PassOn(bus);
  for (const DriveConfig& drive : lens->drives) {
    if (const auto other = (*bus)->WhoIs(drive.unit)) {
      return Fail(Code::BadData, lens->where.Text() + ": " + *other + " is another lens' already");
    }
  }
  drivers::Device device;
  device.lens = std::make_unique<ModbusLens>(*std::move(bus), std::move(lens->drives), clock);
  if (auto greeted = Greet(*device.lens, clock); !greeted) return PassOn(greeted);
  return device;
}

Result<std::vector<drivers::FoundDevice>> ProbeModbus() {
  std::vector<drivers::FoundDevice> found;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/dev/serial/by-id", error)) {
    const std::string path = entry.path().string();
    std::error_code unreadable;
    drivers::FoundDevice port;
    port.model = "serial port " + entry.path().filename().string() + ": drives on it are not searched for";
    port.node = std::filesystem::canonical(entry.path(), unreadable).string();
    port.config =
        "bus = \"rs485\"   # and [[bus]] with name = \"rs485\", driver = \"modbus\", device = \"" + path + "\"";
    found.push_back(std::move(port));
  }
  std::ranges::sort(found, {}, &drivers::FoundDevice::config);
  return found;
}

Result<void> CheckBus(const Settings& bus) {
  auto config = ReadBusConfig(bus);
  if (!config) return PassOn(config);
  return {};
}

}  // namespace lensd::drivers::modbus
