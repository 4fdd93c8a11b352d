// Checksums of kept files: the last comment of TOML, the first member of a JSON object. CRC-32 is zlib's.
#include "io/checked_file.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

#include "io/atomic_file.h"

namespace lensd::io {
namespace {

constexpr std::string_view kLine = "# crc32 ";
constexpr std::string_view kMember = "{\"crc32\":\"";
constexpr std::string_view kAfterMember = "\",";
constexpr std::size_t kDigits = 8;
constexpr std::size_t kLargestKept = std::size_t{16} << 20;
constexpr std::size_t kRandomLetters = 6;  // of a temporary file's name

std::string ChecksumOf(std::string_view text) {
  const uLong sum = crc32_z(0, reinterpret_cast<const Bytef*>(text.data()), text.size());
  char digits[kDigits + 1];
  std::snprintf(digits, sizeof digits, "%08lx", static_cast<unsigned long>(sum));
  return digits;
}

}  // namespace

std::string SignedLines(std::string text) {
  const std::string sum = ChecksumOf(text);
  return std::move(text) + std::string(kLine) + sum + "\n";
}

Integrity IntegrityOfLines(std::string_view text) {
  const std::size_t length = kLine.size() + kDigits + 1;
  const std::size_t begin = text.rfind(kLine);
  if (begin == std::string_view::npos) return Integrity::Unsigned;
  const bool last = text.size() - begin == length && text.back() == '\n';
  const bool same = last && text.substr(begin + kLine.size(), kDigits) == ChecksumOf(text.substr(0, begin));
  return same ? Integrity::Whole : Integrity::Changed;
}

std::string SignedObject(std::string_view text) {
  return std::string(kMember) + ChecksumOf(text) + std::string(kAfterMember) + std::string(text.substr(1));
}

Integrity IntegrityOfObject(std::string_view text) {
  const std::size_t rest = kMember.size() + kDigits;
  if (!text.starts_with(kMember) || text.substr(std::min(rest, text.size()), kAfterMember.size()) != kAfterMember) {
    return Integrity::Unsigned;
  }
  const std::string plain = "{" + std::string(text.substr(rest + kAfterMember.size()));
  return text.substr(kMember.size(), kDigits) == ChecksumOf(plain) ? Integrity::Whole : Integrity::Changed;
}

Result<std::string> KeepDamaged(const std::string& path) {
  std::string copy = path + ".damaged";
  std::error_code error;
  if (std::filesystem::file_size(path, error) > kLargestKept && !error) {
    return Fail(Code::Io, path + ": is too large for a copy");
  }
  std::filesystem::copy_file(path, copy, std::filesystem::copy_options::overwrite_existing, error);
  if (error) return Fail(Code::Io, copy + ": cannot be written: " + error.message());
  return copy;
}

Result<std::optional<std::string>> ReadKeptFile(const std::string& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found) return std::optional<std::string>();
  if (error) return Fail(Code::Io, path + ": " + error.message());
  if (status.type() != std::filesystem::file_type::regular) return Fail(Code::Io, path + ": is no file to be read");
  auto text = ReadWholeFile(path, kLargestKept);
  if (!text) return PassOn(text);
  return std::optional(*std::move(text));
}

void RemoveTemporaries(const std::string& folder) {
  constexpr std::array<std::string_view, 7> kOurs = {".position.json.", ".calibration.toml.", ".presets.toml.",
                                                     ".last.toml.",     ".refocus.toml.",     ".slope.toml.",
                                                     ".direction.toml."};
  std::error_code error;
  std::vector<std::filesystem::path> left;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with('.') || name.size() <= kRandomLetters) continue;
    const std::string_view stem = std::string_view(name).substr(0, name.size() - kRandomLetters);
    if (std::ranges::any_of(kOurs, [&](std::string_view end) { return stem.ends_with(end); })) {
      left.push_back(entry.path());
    }
  }
  for (const auto& path : left) std::filesystem::remove(path, error);
}

}  // namespace lensd::io
