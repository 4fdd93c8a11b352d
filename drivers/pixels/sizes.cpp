// A picture sent in another format than was said has a round number of bytes a pixel: that names the format.
#include "drivers/pixels/sizes.h"

#include <array>

namespace lensd::drivers::pixels {
namespace {

struct Look {
  std::size_t halves;  ///< of a byte a pixel, 2 to a byte
  const char* words;
};
constexpr std::array kLooks{
    Look{2, "one byte a pixel: this looks like mono8"},
    Look{3, "one and a half bytes a pixel: this looks like NV12 or I420"},
    Look{4, "two bytes a pixel: this looks like YUYV or 16 bits a pixel"},
    Look{6, "three bytes a pixel: this looks like RGB"},
    Look{8, "four bytes a pixel: this looks like RGBA"},
    Look{12, "six bytes a pixel: this looks like RGB with 16 bits a colour"},
};

}  // namespace

std::optional<std::string> WhyNotRows(std::size_t bytes, const Rows& rows) {
  const auto height = static_cast<std::size_t>(rows.height), width = static_cast<std::size_t>(rows.width);
  // Quotients cannot overflow where products could.
  const bool enough = bytes >= rows.row && (bytes - rows.row) / rows.stride >= height - 1;
  const std::size_t whole = rows.stride * height;
  if (enough && bytes <= whole + rows.after) return std::nullopt;
  std::string why = std::to_string(bytes) + " bytes came where " + std::to_string(rows.width) + " x " +
                    std::to_string(rows.height) + " pixels take " + std::to_string(rows.height) + " rows of " +
                    std::to_string(rows.stride) + " bytes";
  for (const Look& look : kLooks) {
    if (2 * bytes == look.halves * width * height) return why + ": " + look.words;
  }
  if (!enough) return why + ": a part of it is missing";
  return why + ": " + std::to_string(bytes - whole - rows.after) + " too many";
}

}  // namespace lensd::drivers::pixels
