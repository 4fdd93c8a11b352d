// Files that say whether they are as they were written: their text carries a CRC-32 of the rest of it.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"

namespace lensd::io {

/// What a checksum says of a text.
enum class Integrity {
  Unsigned,  ///< it carries none
  Whole,     ///< nothing has changed since
  Changed    ///< by a hand or by damage
};

/// A text of lines with comments after # (TOML): the checksum is the last line, "# crc32 XXXXXXXX".
std::string SignedLines(std::string text);
Integrity IntegrityOfLines(std::string_view text);

/// A JSON object, serialised without spaces: the checksum is its first member, "crc32". `text` begins with {" .
std::string SignedObject(std::string_view text);
Integrity IntegrityOfObject(std::string_view text);

/// Copies a damaged file to PATH.damaged, over what an earlier time left there, so that nothing is lost when it is
/// written anew. The answer is the copy's path. Io: also where it is no file, or larger than any file of ours.
Result<std::string> KeepDamaged(const std::string& path);

/// The text of a file of ours, which is never waited for: what is no regular file (a folder, a pipe) is Io. Nothing:
/// there is none.
Result<std::optional<std::string>> ReadKeptFile(const std::string& path);

/// Deletes what killed processes left of temporary files (see atomic_file.h) of files in `folder` whose names end in
/// one of ours: positions, calibrations, presets, and what else lensd has learned of a lens. A folder that cannot be
/// read is left alone.
void RemoveTemporaries(const std::string& folder);

}  // namespace lensd::io
