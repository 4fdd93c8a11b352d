// A backup of lensd: its configuration and what it keeps of its lenses, in one file.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"

namespace lensd::cli {

/// The two folders that lensd's files are in: that of its configuration, which has a name of its own, and its state.
struct DaemonFolders {
  std::string config;  ///< the configuration file
  std::string state;
};

/// One file of it.
struct BackedUp {
  enum class Folder { Config, State };
  Folder folder = Folder::Config;
  std::string path;  ///< from there; the configuration itself is kConfigName, whatever it is called
  std::string bytes;
};
inline constexpr const char* kConfigName = "lensd.toml";

struct Backup {
  std::string made;   ///< when, for people
  std::string host;   ///< where
  std::string lensd;  ///< by which version
  std::vector<BackedUp> files;
};

/// What is to be kept of these folders: the configuration, its drop-ins, the files beside it that they name, and
/// calibrations, presets and positions. Io: what cannot be read; `outside` is told of files that are named and lie
/// elsewhere: they are left out.
Result<Backup> CollectBackup(const DaemonFolders& folders, std::vector<std::string>& outside);

/// As text, with a checksum; and back. BadData: damaged, no backup, or of a newer lensd.
std::string BackupText(const Backup& backup);
Result<Backup> BackupFromText(const std::string& text, const std::string& name);

/// Writes every file below `folder` (made anew): config/..., state/.... For a look before anything is replaced.
Result<void> UnpackBackup(const Backup& backup, const std::string& folder);

/// Puts all of it in place, or nothing: what is there and belongs to the same set is kept as *.before-restore. Returns
/// the paths that were kept so. Io: then all is as it was.
Result<std::vector<std::string>> InstallBackup(const Backup& backup, const DaemonFolders& folders);

}  // namespace lensd::cli
