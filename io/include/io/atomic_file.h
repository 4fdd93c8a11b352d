// Files that are always whole: a reader finds the old contents or the new, whatever happened in between.
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"

namespace lensd::io {

/// Replaces the file at `path` by `contents` so that a crash or a power cut at any moment leaves either the old file or
/// the new one: writes a temporary file beside it, flushes it to disk, renames it over `path` and flushes the folder. A
/// symbolic link at `path` is followed; a file that exists keeps its permissions, a new one gets 0644 less the umask.
/// On success the contents are on disk. On Code::Io ("path: what went wrong") before the rename the old file is as it
/// was and no temporary file is left; if only the last flush fails the new contents are there but may not outlive a
/// power cut, and the message says so. Temporary files are named ".NAME.XXXXXX": what a killed process leaves of them
/// may be deleted. Blocks for the disk. One writer at a time; readers need no lock.
Result<void> WriteFileAtomically(const std::string& path, std::string_view contents);

/// The same in two steps, for who must not let it happen any more where the first took too long: the temporary file is
/// written and on disk, and removed with this unless it took its name. Move-only.
class WrittenFile {
 public:
  static Result<WrittenFile> Create(const std::string& path, std::string_view contents);
  WrittenFile(WrittenFile&& other) noexcept;
  WrittenFile& operator=(WrittenFile&&) = delete;
  ~WrittenFile();
  /// Puts it in the place of the file at `path`; once.
  Result<void> Replace();

 private:
  WrittenFile() = default;
  std::string asked_;      ///< as the caller names it
  std::string target_;     ///< behind links
  std::string temporary_;  ///< empty: there is none any more
};

/// The whole file as text. Code::Io: "path: what went wrong"; a file of more than `limit` bytes is refused as BadData.
Result<std::string> ReadWholeFile(const std::string& path, std::size_t limit = std::size_t{16} << 20);

}  // namespace lensd::io
