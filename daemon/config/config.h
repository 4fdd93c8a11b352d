// The daemon's configuration file: which lenses there are, and how each is set up.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/settings.h"
#include "daemon/config/file_mark.h"
#include "daemon/config/references.h"
#include "daemon/server/access.h"
#include "drivers/api/device.h"
#include "rig/config.h"

namespace lensd::daemon {

/// Which driver opens a device, and the keys meant for it.
struct DeviceConfig {
  const drivers::Driver* driver = nullptr;
  Settings settings;   ///< what remains of the table without the daemon's own keys
  std::string lens{};  ///< whose device it is
  /// process = "own": the number of the process in which the driver runs, 0 while it has none. Copies share it, any
  /// thread. nullptr: the driver runs inside lensd.
  std::shared_ptr<std::atomic<int>> process{};
  std::string shares{};  ///< devices with the same text share this process; empty: none
};

/// One [[lens]].
struct LensConfig {
  std::string name;
  Location where;
  Settings table;  ///< all of it as written, with the optics of a model in place of its name
  DeviceConfig device;
  std::optional<DeviceConfig> camera;  ///< [lens.camera]
  bool home_at_start = false;          ///< start = "home"
  bool start_last = false;             ///< start = "last"
  std::string start_preset;            ///< start = "preset:NAME"; empty: none
  rig::RigConfig rig;
  std::vector<std::string> on_failure;  ///< program and arguments that are told of failures; empty: none
  std::vector<FileMark> files;          ///< that it names, as they were when this was read, but for the calibration
};

/// Whether both configure the same in what a lens is opened with, with the same files.
bool SameLens(const LensConfig& one, const LensConfig& other);
/// The first file that is another one; empty: none.
std::string ChangedFile(const LensConfig& one, const LensConfig& other);

/// Read where none is named. It may be missing where it has drop-ins.
inline constexpr const char* kUsualConfig = "/etc/lensd/lensd.toml";

/// The file of this process' configuration, absolute, once main() has named it; empty: none. Named before any thread.
void NameConfiguration(const std::string& path);
const std::string& NamedConfiguration();

struct Config {
  AccessConfig access;  ///< of the last file that has [access]
  Buses buses;
  std::vector<LensConfig> lenses;
};

/// Reads the file and then the drop-ins FILE.d/*.toml in the order of their names, each a file of the same format whose
/// buses and lenses are added; a lens hangs on a bus of its own file or of one read before. Code::Io: cannot be read.
/// Code::BadData: "file:line: what is wrong"; what the format allows and this version cannot do is an error as well,
/// never ignored.
Result<Config> ReadConfig(const std::string& path);

}  // namespace lensd::daemon
