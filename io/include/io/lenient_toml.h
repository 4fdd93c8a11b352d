// TOML files with mistakes of syntax, read on past them.
#pragma once

#include <string>
#include <vector>

#include "base/settings.h"

namespace lensd::io {

/// A file as far as it is TOML.
struct LenientToml {
  Settings settings;  ///< a line with a mistake counts as its key with an empty string; empty where that cannot be
  std::vector<Error> faults;  ///< in the order of their lines; Code::Io, Code::BadData as of ReadTomlFile
  bool whole = true;          ///< false: from the last fault on nothing could be read
};
LenientToml ReadTomlLeniently(const std::string& path);

}  // namespace lensd::io
