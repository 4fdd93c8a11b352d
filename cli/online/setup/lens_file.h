// A file of its own for one lens, in the folder of drop-ins beside the configuration.
#pragma once

#include <string>

#include "cli/terminal/session.h"

namespace lensd::cli {

/// What is known of a lens, as lines of TOML; each is empty or ends with a line break.
struct NewLens {
  std::string name;
  std::string bus;     ///< a whole [[bus]]
  std::string keys;    ///< of [[lens]], behind its name
  std::string tables;  ///< [lens.focus], [lens.drives.focus] ...
  std::string optics;  ///< keys of [lens.optics]
  std::string camera;  ///< keys of [lens.camera]
};
std::string LensFileText(const NewLens& lens);

/// `"TEXT"` as TOML has it; control characters become spaces.
std::string QuotedToml(const std::string& text);

/// The folder of drop-ins of this configuration, which lensd reads beside it.
std::string DropInFolder(const std::string& configuration);

/// NotPermitted: this user may not write into the folder, or not create it. Writes nothing.
std::expected<void, Failure> MayWriteInto(const std::string& folder);

/// One new file in a folder. What is there already is never replaced.
class LensFile {
 public:
  /// Writes `text` beside the place of the file, under a name that lensd does not read, and has lensd's program check
  /// it alone (with the rest would open devices that are in use: Reload checks that). Creates the folder, and keeps it
  /// locked while the object lives, so that one program after the other adds: `patience` long it waits for another.
  /// CannotWrite: there is such a file already, or it cannot be written; Config: the mistakes that lensd finds; Busy:
  /// another program is still adding. Nothing stays after a failure.
  static std::expected<LensFile, Failure> Prepare(const std::string& folder, const std::string& name,
                                                  const std::string& text, Duration patience);

  LensFile(LensFile&& other) noexcept;
  LensFile(const LensFile&) = delete;
  LensFile& operator=(const LensFile&) = delete;
  LensFile& operator=(LensFile&&) = delete;
  /// Takes away what was not kept.
  ~LensFile();

  /// Gives the file its name. CannotWrite: there is one of this name by now.
  std::expected<void, Failure> Place();
  /// It stays.
  void Keep();
  /// Takes the file away again, and the folder where it was created for the file.
  void TakeAway();

  const std::string& path() const { return path_; }

 private:
  LensFile(std::string folder, std::string path) : folder_(std::move(folder)), path_(std::move(path)) {}
  std::expected<void, Failure> LockFolder(Duration patience);

  std::string folder_;
  std::string path_;
  std::string draft_;     ///< empty: there is none
  bool placed_ = false;   ///< under its name, and not kept for good
  bool created_ = false;  ///< the folder
  int lock_ = -1;         ///< the folder, open and locked; -1: not
};

}  // namespace lensd::cli
