// One row a format. GUIDs of uncompressed formats are four letters and a common ending (UVC 1.1, Uncompressed Payload).
#include "pixel_format.h"

#include <algorithm>

namespace lensd::drivers::uvc {
namespace {

using pixels::Packing;

constexpr PixelFormatInfo kFormats[] = {
    {PixelFormat::Grey16, "y16", {"Y16 ", ""}, 2, {.packing = Packing::Words, .bits = 16}},
    {PixelFormat::Grey12, "y12", {"Y12 ", ""}, 2, {.packing = Packing::Words, .bits = 12}},
    {PixelFormat::Grey10, "y10", {"Y10 ", ""}, 2, {.packing = Packing::Words, .bits = 10}},
    {PixelFormat::Grey8, "y8", {"Y800", "Y8  "}, 1, {.packing = Packing::Bytes}},
    {PixelFormat::Yuyv, "yuyv", {"YUY2", ""}, 2, {.packing = Packing::Yuyv}},
    {PixelFormat::Mjpeg, "mjpeg", {"", ""}, 2, {.packing = Packing::Jpeg}},
};

constexpr std::array<std::uint8_t, 12> kGuidEnding = {0x00, 0x00, 0x10, 0x00, 0x80, 0x00,
                                                      0x00, 0xAA, 0x00, 0x38, 0x9B, 0x71};

}  // namespace

std::span<const PixelFormatInfo> PixelFormats() {
  return kFormats;
}

const PixelFormatInfo& InfoOf(PixelFormat format) {
  return *std::ranges::find(kFormats, format, &PixelFormatInfo::format);
}

const PixelFormatInfo* FormatOfGuid(std::span<const std::uint8_t, 16> guid) {
  if (!std::ranges::equal(guid.subspan<4>(), kGuidEnding)) return nullptr;
  const std::string_view letters(reinterpret_cast<const char*>(guid.data()), 4);
  const auto* found = std::ranges::find_if(
      kFormats, [&](const PixelFormatInfo& one) { return std::ranges::find(one.codes, letters) != one.codes.end(); });
  return found == std::end(kFormats) ? nullptr : found;
}

}  // namespace lensd::drivers::uvc
