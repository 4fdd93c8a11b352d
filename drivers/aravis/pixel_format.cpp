// Pixel formats by the numbers of the Pixel Format Naming Convention, unpacked to luminance. A picture shorter than its
// format says is refused before this.
#include "pixel_format.h"

#include <algorithm>
#include <string>
#include <utility>

#include "drivers/pixels/colour.h"
#include "drivers/pixels/luma.h"
#include "drivers/pixels/sizes.h"

namespace lensd::drivers::aravis {
namespace {

using enum Packing;
using enum Colour;

constexpr PixelFormat kFormats[] = {
    {0x01080001, "Mono8", 8, Bytes, Mono},
    {0x01100003, "Mono10", 10, Words, Mono},
    {0x010C0004, "Mono10Packed", 10, GigePacked, Mono},
    {0x010A0046, "Mono10p", 10, Lsb, Mono},
    {0x01100005, "Mono12", 12, Words, Mono},
    {0x010C0006, "Mono12Packed", 12, GigePacked, Mono},
    {0x010C0047, "Mono12p", 12, Lsb, Mono},
    {0x01100025, "Mono14", 14, Words, Mono},
    {0x01100007, "Mono16", 16, Words, Mono},
    {0x01080008, "BayerGR8", 8, Bytes, Bayer},
    {0x01080009, "BayerRG8", 8, Bytes, Bayer},
    {0x0108000A, "BayerGB8", 8, Bytes, Bayer},
    {0x0108000B, "BayerBG8", 8, Bytes, Bayer},
    {0x0110000C, "BayerGR10", 10, Words, Bayer},
    {0x0110000D, "BayerRG10", 10, Words, Bayer},
    {0x0110000E, "BayerGB10", 10, Words, Bayer},
    {0x0110000F, "BayerBG10", 10, Words, Bayer},
    {0x01100010, "BayerGR12", 12, Words, Bayer},
    {0x01100011, "BayerRG12", 12, Words, Bayer},
    {0x01100012, "BayerGB12", 12, Words, Bayer},
    {0x01100013, "BayerBG12", 12, Words, Bayer},
    {0x010C0026, "BayerGR10Packed", 10, GigePacked, Bayer},
    {0x010C0027, "BayerRG10Packed", 10, GigePacked, Bayer},
    {0x010C0028, "BayerGB10Packed", 10, GigePacked, Bayer},
    {0x010C0029, "BayerBG10Packed", 10, GigePacked, Bayer},
    {0x010C002A, "BayerGR12Packed", 12, GigePacked, Bayer},
    {0x010C002B, "BayerRG12Packed", 12, GigePacked, Bayer},
    {0x010C002C, "BayerGB12Packed", 12, GigePacked, Bayer},
    {0x010C002D, "BayerBG12Packed", 12, GigePacked, Bayer},
    {0x010A0052, "BayerBG10p", 10, Lsb, Bayer},
    {0x010A0054, "BayerGB10p", 10, Lsb, Bayer},
    {0x010A0056, "BayerGR10p", 10, Lsb, Bayer},
    {0x010A0058, "BayerRG10p", 10, Lsb, Bayer},
    {0x010C0053, "BayerBG12p", 12, Lsb, Bayer},
    {0x010C0055, "BayerGB12p", 12, Lsb, Bayer},
    {0x010C0057, "BayerGR12p", 12, Lsb, Bayer},
    {0x010C0059, "BayerRG12p", 12, Lsb, Bayer},
    {0x0110002E, "BayerGR16", 16, Words, Bayer},
    {0x0110002F, "BayerRG16", 16, Words, Bayer},
    {0x01100030, "BayerGB16", 16, Words, Bayer},
    {0x01100031, "BayerBG16", 16, Words, Bayer},
    {0x02180014, "RGB8", 8, Interleaved, Rgb},
    {0x02180015, "BGR8", 8, Interleaved, Bgr},
};

/// Bits a pixel takes in memory.
int StoredBits(const PixelFormat& format) {
  switch (format.packing) {
    case Bytes:
      return 8;
    case Words:
      return 16;
    case Lsb:
      return format.bits;
    case GigePacked:
      return 12;
    case Interleaved:
      return 24;
  }
  return 8;
}

/// Rec. 709 weights in 1/256.
std::uint16_t Luma709(unsigned red, unsigned green, unsigned blue) {
  return static_cast<std::uint16_t>((54 * red + 183 * green + 19 * blue + 128) >> 8);
}

/// Reads the samples of one picture by their number, counted across its lines.
class Samples {
 public:
  Samples(const PixelFormat& format, std::span<const std::uint8_t> data)
      : format_(format), data_(data), mask_((1u << format.bits) - 1u) {}

  std::uint16_t At(std::size_t line_start, std::size_t i) const {
    const std::uint8_t* line = data_.data() + line_start;
    switch (format_.packing) {
      case Bytes:
        return line[i];
      case Words:
        return static_cast<std::uint16_t>((line[2 * i] | line[2 * i + 1] << 8) & static_cast<int>(mask_));
      case Lsb:
        return FromLsb(line, i);
      case GigePacked:
        return FromPairs(line, i);
      case Interleaved:
        return FromColours(line + 3 * i);
    }
    return 0;
  }

 private:
  std::uint16_t FromLsb(const std::uint8_t* line, std::size_t i) const {
    const std::size_t bit = i * static_cast<std::size_t>(format_.bits);
    const unsigned two = line[bit / 8] | static_cast<unsigned>(line[bit / 8 + 1]) << 8;
    return static_cast<std::uint16_t>((two >> (bit % 8)) & mask_);
  }

  /// The middle byte holds the low bits: of the first sample in its lower half, of the second in its upper half.
  std::uint16_t FromPairs(const std::uint8_t* line, std::size_t i) const {
    const std::uint8_t* pair = line + i / 2 * 3;
    const int low_bits = format_.bits - 8;
    const unsigned high = i % 2 == 0 ? pair[0] : pair[2];
    const unsigned low = (i % 2 == 0 ? pair[1] : pair[1] >> 4) & ((1u << low_bits) - 1u);
    return static_cast<std::uint16_t>(high << low_bits | low);
  }

  std::uint16_t FromColours(const std::uint8_t* pixel) const {
    return format_.colour == Bgr ? Luma709(pixel[2], pixel[1], pixel[0]) : Luma709(pixel[0], pixel[1], pixel[2]);
  }

  const PixelFormat& format_;
  std::span<const std::uint8_t> data_;
  unsigned mask_;
};

/// Bytes a line takes, and bits it is shifted by where lines follow each other without beginning at a byte.
std::size_t LineBits(const PixelFormat& format, int width, int padding) {
  const std::size_t bits = static_cast<std::size_t>(width) * static_cast<std::size_t>(StoredBits(format));
  if (padding == 0) return bits;
  return (bits + 7) / 8 * 8 + 8 * static_cast<std::size_t>(padding);
}

}  // namespace

std::span<const PixelFormat> PixelFormats() {
  return kFormats;
}

const PixelFormat* FindPixelFormat(std::uint32_t code) {
  const auto* found = std::ranges::find(kFormats, code, &PixelFormat::code);
  return found == std::end(kFormats) ? nullptr : found;
}

const PixelFormat* FindPixelFormat(std::string_view name) {
  const auto* found = std::ranges::find(kFormats, name, &PixelFormat::name);
  return found == std::end(kFormats) ? nullptr : found;
}

std::size_t BytesOf(const PixelFormat& format, int width, int height, int padding) {
  return (LineBits(format, width, padding) * static_cast<std::size_t>(height) + 7) / 8;
}

namespace {

/// One sample a pixel, as it lies in memory; of pixels of three colours their luminance.
Result<std::vector<std::uint16_t>> Unpack(const PixelFormat& format, std::span<const std::uint8_t> data, int width,
                                          int height, int padding) {
  if (width <= 0 || height <= 0 || padding < 0) return Fail(Code::Protocol, "the camera sent a picture without pixels");
  const std::size_t bytes = BytesOf(format, width, height, padding);
  if (data.size() < bytes) {
    return Fail(Code::Protocol,
                "the camera sent " + std::to_string(data.size()) + " bytes of a picture of " + std::to_string(bytes));
  }
  // Transport layers round a payload up; a whole line more is another format than was said.
  const std::size_t line = (LineBits(format, width, padding) + 7) / 8;
  if (data.size() >= bytes + line) {
    return Fail(Code::Protocol, pixels::WhyNotRows(data.size(), {width, height, line, line, line - 1})
                                    .value_or("the camera sent more bytes than its picture takes"));
  }
  // The reader of packed samples looks one byte ahead of the last.
  std::vector<std::uint8_t> copy;
  if (format.packing == Lsb && data.size() == bytes) {
    copy.assign(data.begin(), data.end());
    copy.push_back(0);
    data = copy;
  }
  const Samples samples(format, data);
  const std::size_t w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height);
  const std::size_t line_bits = LineBits(format, width, padding);
  std::vector<std::uint16_t> unpacked(w * h);
  for (std::size_t y = 0; y < h; ++y) {
    // Without padding packed lines run on through the bytes: then every sample is counted from the first of all.
    const bool runs_on = line_bits % 8 != 0 || padding == 0;
    const std::size_t start = runs_on ? 0 : y * line_bits / 8;
    const std::size_t first = runs_on ? y * w : 0;
    for (std::size_t x = 0; x < w; ++x) unpacked[y * w + x] = samples.At(start, first + x);
  }
  return unpacked;
}

/// By the letters in "BayerGR10p" and the like.
pixels::Mosaic MosaicOf(const PixelFormat& format) {
  const std::string_view order = format.name.substr(std::string_view("Bayer").size(), 2);
  if (order == "RG") return pixels::Mosaic::Rggb;
  if (order == "GR") return pixels::Mosaic::Grbg;
  return order == "GB" ? pixels::Mosaic::Gbrg : pixels::Mosaic::Bggr;
}

std::vector<std::uint16_t> FromTriples(const PixelFormat& format, std::span<const std::uint8_t> data, int width,
                                       int height, int padding) {
  const std::size_t row = 3 * static_cast<std::size_t>(width), stride = row + static_cast<std::size_t>(padding);
  std::vector<std::uint16_t> colours;
  colours.reserve(row * static_cast<std::size_t>(height));
  for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
    const auto line = data.subspan(y * stride, row);
    colours.insert(colours.end(), line.begin(), line.end());
  }
  if (format.colour == Bgr) {
    for (std::size_t i = 0; i < colours.size(); i += 3) std::swap(colours[i], colours[i + 2]);
  }
  return colours;
}

}  // namespace

Result<std::vector<std::uint16_t>> LumaOf(const PixelFormat& format, std::span<const std::uint8_t> data, int width,
                                          int height, int padding) {
  auto luma = Unpack(format, data, width, height, padding);
  if (luma && format.colour == Bayer) pixels::AverageMosaic(*luma, width, height);
  return luma;
}

std::function<std::shared_ptr<const std::vector<std::uint16_t>>()> MakerOfColour(const PixelFormat& format,
                                                                                 std::span<const std::uint8_t> data,
                                                                                 int width, int height, int padding) {
  using Colours = std::vector<std::uint16_t>;
  if (format.colour == Mono) return nullptr;
  const auto kept = std::make_shared<const std::vector<std::uint8_t>>(data.begin(), data.end());
  return [=]() -> std::shared_ptr<const Colours> {
    if (width <= 0 || height <= 0 || padding < 0 || kept->size() < BytesOf(format, width, height, padding))
      return nullptr;
    if (format.colour != Bayer)
      return std::make_shared<const Colours>(FromTriples(format, *kept, width, height, padding));
    const auto samples = Unpack(format, *kept, width, height, padding);
    if (!samples) return nullptr;
    return std::make_shared<const Colours>(pixels::ColourOfMosaic(*samples, width, height, MosaicOf(format)));
  };
}

}  // namespace lensd::drivers::aravis
