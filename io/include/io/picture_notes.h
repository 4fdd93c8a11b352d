// What a picture file says of how it was taken: EXIF and XMP in PNG and JPEG.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"

namespace lensd::io {

/// Empty, or nothing: not known, and left out.
struct PictureNotes {
  std::string software{};                   ///< EXIF Software
  std::string taken{};                      ///< EXIF DateTimeOriginal: "2026:11:23 20:15:00"
  std::string lens{};                       ///< EXIF LensModel
  std::optional<double> exposure_s{};       ///< EXIF ExposureTime
  std::optional<double> f_number{};         ///< EXIF FNumber
  std::optional<double> distance_m{};       ///< EXIF SubjectDistance; infinity is infinity
  std::optional<double> focal_length_mm{};  ///< EXIF FocalLength
  /// XMP properties of the namespace kNotesNamespace, by name.
  std::vector<std::pair<std::string, std::string>> own{};
};

inline constexpr const char* kNotesNamespace = "urn:io.lensd.Lens:1.0/";

/// Adds them to a whole PNG (eXIf and iTXt) or JPEG (APP1), whose picture stays as it is, byte for byte. BadData: it is
/// neither.
Result<void> AddNotes(std::vector<std::uint8_t>& file, const PictureNotes& notes);

/// PictureNotes::own of a PNG file that has any: what AddNotes() wrote, in the same order. Nothing else of the file is
/// read. Code::Io; Code::BadData: not a PNG, or damaged before the picture begins.
Result<std::vector<std::pair<std::string, std::string>>> ReadOwnNotes(const std::string& path);

}  // namespace lensd::io
