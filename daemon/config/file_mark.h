// Whether a file is another one than it was.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/settings.h"

namespace lensd::daemon {

/// What changes when a file is written or replaced; of one that is not there all but the path is 0.
struct FileMark {
  std::string path;
  std::uint64_t size = 0;
  std::uint64_t inode = 0;
  std::int64_t changed_ns = 0;
  bool operator==(const FileMark&) const = default;
};

FileMark MarkOf(const std::string& path);

/// Of every file that is there and that these settings name, and of those that TOML files among them name (the pictures
/// of a scene). Paths are relative to the file they are written in. Reads files: not in the event loop.
std::vector<FileMark> MarksOfFilesIn(const Settings& settings);

}  // namespace lensd::daemon
