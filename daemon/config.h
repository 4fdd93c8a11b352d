// The daemon's configuration file: which lenses there are, and how each is set up.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "access.h"
#include "base/result.h"
#include "base/settings.h"
#include "drivers/api/device.h"
#include "references.h"
#include "rig/config.h"

namespace lensd::daemon {

/// Which driver opens a device, and the keys meant for it.
struct DeviceConfig {
  const drivers::Driver* driver = nullptr;
  Settings settings;  ///< what remains of the table without the daemon's own keys
};

/// One [[lens]].
struct LensConfig {
  std::string name;
  Location where;
  Settings table;  ///< all of it as written
  DeviceConfig device;
  std::optional<DeviceConfig> camera;  ///< [lens.camera]
  bool home_at_start = false;          ///< start = "home"
  rig::RigConfig rig;
};

/// Whether both configure the same; the files they name are not looked at.
bool SameLens(const LensConfig& one, const LensConfig& other);

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
