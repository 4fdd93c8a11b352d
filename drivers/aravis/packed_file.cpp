// The places of a zip file (PKWARE's APPNOTE, 4.3): its end, the directory before that, and a header before each file.
#include "packed_file.h"

#include <cstddef>
#include <cstdint>
#include <string>

namespace lensd::drivers::aravis {
namespace {

constexpr std::size_t kEndBytes = 20, kEntryBytes = 46, kHeaderBytes = 30;  // as much of each as Aravis reads
constexpr std::uint64_t kEntrySign = 0x02014b50, kHeaderSign = 0x04034b50;
constexpr std::string_view kEndSign = "PK\x05\x06";
constexpr std::uint64_t kLargestUnpacked = std::uint64_t{16} << 20;

/// A number of `size` bytes, the lowest first.
std::uint64_t NumberAt(std::string_view bytes, std::uint64_t at, std::size_t size) {
  std::uint64_t number = 0;
  for (std::size_t i = size; i > 0; --i) number = number << 8 | static_cast<unsigned char>(bytes[at + i - 1]);
  return number;
}

bool Holds(std::string_view bytes, std::uint64_t at, std::uint64_t size) {
  return at <= bytes.size() && size <= bytes.size() - at;
}

std::unexpected<Error> BrokenZip(const std::string& where) {
  return Fail(Code::BadData, "is a broken zip file: " + where);
}

/// The file that the entry at `at` stands for; `base` is what every place of the zip file counts from.
Result<void> CheckPacked(std::string_view bytes, std::uint64_t base, std::uint64_t at) {
  const std::uint64_t packed = NumberAt(bytes, at + 20, 4), unpacked = NumberAt(bytes, at + 24, 4);
  if (unpacked > kLargestUnpacked) {
    return Fail(Code::BadData, "unpacks to " + std::to_string(unpacked) + " bytes, more than lensd accepts (16 MiB)");
  }
  const std::uint64_t header = base + NumberAt(bytes, at + 42, 4);
  if (!Holds(bytes, header, kHeaderBytes) || NumberAt(bytes, header, 4) != kHeaderSign) {
    return BrokenZip("no file is where its directory says");
  }
  const std::uint64_t data = header + kHeaderBytes + NumberAt(bytes, header + 26, 2) + NumberAt(bytes, header + 28, 2);
  if (!Holds(bytes, data, packed)) return BrokenZip("it ends before what it holds");
  return {};
}

}  // namespace

Result<void> CheckPackedFile(std::string_view bytes) {
  const std::size_t end = bytes.rfind(kEndSign);
  if (end == std::string_view::npos || !Holds(bytes, end, kEndBytes)) return BrokenZip("it has no end");
  const std::uint64_t count = NumberAt(bytes, end + 10, 2);
  if (count == 0 || NumberAt(bytes, end + 8, 2) != count) return BrokenZip("it holds no file");
  // What stands before the zip file is allowed, and counts in no place.
  const std::uint64_t size = NumberAt(bytes, end + 12, 4), offset = NumberAt(bytes, end + 16, 4);
  if (size + offset > end) return BrokenZip("its directory is not inside");
  const std::uint64_t base = end - size - offset;
  std::uint64_t at = base + offset;
  for (std::uint64_t i = 0; i < count; ++i) {
    if (!Holds(bytes, at, kEntryBytes) || NumberAt(bytes, at, 4) != kEntrySign) {
      return BrokenZip("its directory has not as many entries as it says");
    }
    const std::uint64_t name = NumberAt(bytes, at + 28, 2);
    if (!Holds(bytes, at + kEntryBytes, name)) return BrokenZip("its directory is not inside");
    if (auto good = CheckPacked(bytes, base, at); !good) return good;
    at += kEntryBytes + name + NumberAt(bytes, at + 30, 2) + NumberAt(bytes, at + 32, 2);
  }
  return {};
}

}  // namespace lensd::drivers::aravis
