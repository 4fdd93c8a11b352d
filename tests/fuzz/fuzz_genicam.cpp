// Pictures of GenICam cameras: any format, size and padding with any bytes either gives every pixel, none above the
// format's bits, or is refused.
#include <cstdint>
#include <span>

#include "pixel_format.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lensd::drivers::aravis;
  constexpr std::size_t kHeader = 4;
  if (size < kHeader) return 0;
  const auto formats = PixelFormats();
  const PixelFormat& format = formats[data[0] % formats.size()];
  const int width = data[1] + 1, height = data[2] % 64 + 1, padding = data[3] % 16;
  const std::span<const std::uint8_t> picture(data + kHeader, size - kHeader);
  const auto luma = LumaOf(format, picture, width, height, padding);
  if (!luma) return 0;
  if (luma->size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) __builtin_trap();
  for (const std::uint16_t value : *luma) {
    if (value >> format.bits != 0) __builtin_trap();
  }
  return 0;
}
