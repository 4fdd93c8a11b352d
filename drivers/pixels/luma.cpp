// Raw rows of every supported format to linear 16-bit samples or as stored, row by row.
#include "drivers/pixels/luma.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <utility>

#include "drivers/pixels/jpeg.h"
#include "drivers/pixels/sizes.h"

namespace lensd::drivers::pixels {
namespace {

using Samples = std::vector<std::uint16_t>;

bool CanBe(const RawFormat& format, const RawPicture& picture) {
  if (picture.width < 1 || picture.height < 1 || picture.width > 65536 || picture.height > 65536) return false;
  switch (format.packing) {
    case Packing::Words:
      return format.bits >= 8 && format.bits <= 16;
    case Packing::Csi2:
      return format.bits == 10 || format.bits == 12 || format.bits == 14;
    case Packing::Yuyv:
    case Packing::Uyvy:
    case Packing::Jpeg:
      return format.bits == 8 && format.mosaic == Mosaic::None;
    case Packing::Bytes:
      return format.bits == 8;
  }
  return false;
}

/// Samples that share their low bits, and the bytes they take.
struct Group {
  int samples;
  int bytes;
};
Group GroupOf(int bits) {
  if (bits == 12) return {2, 3};
  return bits == 10 ? Group{4, 5} : Group{4, 7};
}

/// 10 bits: four high bytes, then one byte with four pairs of low bits, the first sample's lowest. 12 bits: two high
/// bytes, one byte with two nibbles. 14 bits: four high bytes, then four times six low bits in three bytes.
void UnpackCsi2(const std::uint8_t* row, int bits, int width, std::uint16_t* out) {
  const Group group = GroupOf(bits);
  const int low_bits = bits - 8;
  for (int x = 0; x < width; x += group.samples, row += group.bytes) {
    std::uint32_t low = 0;
    for (int i = group.samples; i < group.bytes; ++i) low |= std::uint32_t{row[i]} << (8 * (i - group.samples));
    for (int i = 0; i < std::min(group.samples, width - x); ++i) {
      const std::uint32_t rest = (low >> (low_bits * i)) & ((1u << low_bits) - 1u);
      out[x + i] = static_cast<std::uint16_t>((std::uint32_t{row[i]} << low_bits) | rest);
    }
  }
}

void UnpackRow(const RawFormat& format, const std::uint8_t* row, int width, std::uint16_t* out) {
  const int top = (1 << format.bits) - 1;
  switch (format.packing) {
    case Packing::Words:
      for (int x = 0; x < width; ++x) {
        out[x] = static_cast<std::uint16_t>(std::min(row[2 * x] | row[2 * x + 1] << 8, top));
      }
      return;
    case Packing::Csi2:
      return UnpackCsi2(row, format.bits, width, out);
    case Packing::Yuyv:
      for (int x = 0; x < width; ++x) out[x] = row[2 * x];
      return;
    case Packing::Uyvy:
      for (int x = 0; x < width; ++x) out[x] = row[2 * x + 1];
      return;
    case Packing::Bytes:
    case Packing::Jpeg:
      std::copy_n(row, width, out);
  }
}

/// 16..235 of 8 bits to 0..255.
void StretchLimited(Samples& samples) {
  static constexpr auto kStretched = [] {
    std::array<std::uint16_t, 256> table{};
    for (int i = 0; i < 256; ++i)
      table[static_cast<std::size_t>(i)] = static_cast<std::uint16_t>(std::clamp(((i - 16) * 255 + 109) / 219, 0, 255));
    return table;
  }();
  for (auto& sample : samples) sample = kStretched[sample];
}

}  // namespace

void AverageMosaic(std::vector<std::uint16_t>& samples, int width, int height) {
  if (width < 2 || height < 2) return;
  // In place, row by row: each output needs its own row and the one below. The last row and column look back instead,
  // where a square of four colours lies as well.
  const auto at = [&](int x, int y) -> std::uint16_t& {
    return samples[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  };
  for (int y = 0; y + 1 < height; ++y) {
    for (int x = 0; x + 1 < width; ++x) {
      at(x, y) = static_cast<std::uint16_t>((at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1) + 2) / 4);
    }
    at(width - 1, y) = at(width - 2, y);
  }
  for (int x = 0; x < width; ++x) at(x, height - 1) = at(x, height - 2);
}

std::size_t RowBytes(const RawFormat& format, int width) {
  const auto count = static_cast<std::size_t>(width);
  switch (format.packing) {
    case Packing::Bytes:
      return count;
    case Packing::Words:
    case Packing::Yuyv:
    case Packing::Uyvy:
      return 2 * count;
    case Packing::Csi2: {
      const Group group = GroupOf(format.bits);
      const auto samples = static_cast<std::size_t>(group.samples);
      return (count + samples - 1) / samples * static_cast<std::size_t>(group.bytes);
    }
    case Packing::Jpeg:
      break;
  }
  return 0;
}

Result<Samples> LumaReader::ReadJpeg(const RawPicture& picture) {
  // A picture of which a part is lost would be measured as blurred.
  const auto decoded = DecodeJpeg(picture.bytes, picture.width, picture.height, 1);
  if (!decoded) return PassOn(decoded);
  flawed_ = decoded->flawed;
  return Samples(decoded->samples.begin(), decoded->samples.end());
}

namespace {

/// Of the planes of colour that follow the luminance.
std::size_t ChromaBytes(const RawFormat& format, std::size_t stride, std::size_t rows) {
  const std::size_t half_rows = (rows + 1) / 2;
  switch (format.chroma) {
    case Chroma::None:
      break;
    case Chroma::CbCr:
    case Chroma::CrCb:
      return stride * half_rows;
    case Chroma::Planes:
      return (stride + 1) / 2 * half_rows * 2;
  }
  return 0;
}

/// Nothing: the bytes are as many as the picture takes, with the padding that its device has said.
std::optional<std::string> WhyNotPicture(const RawFormat& format, const RawPicture& picture, std::size_t row_bytes,
                                         std::size_t stride) {
  const auto rows = static_cast<std::size_t>(picture.height);
  std::size_t after = ChromaBytes(format, stride, rows);
  const std::size_t whole = stride * rows + after;
  // Devices pad to whole rows or to a round number of bytes; twice as much is no padding.
  const bool is_padding = picture.declared % 16 == 0 || picture.declared % stride == 0;
  if (is_padding && picture.declared > whole && picture.declared < 2 * whole) after = picture.declared - stride * rows;
  return WhyNotRows(picture.bytes.size(), {picture.width, picture.height, row_bytes, stride, after});
}

}  // namespace

Result<Samples> Unpack(const RawFormat& format, const RawPicture& picture) {
  const std::size_t row_bytes = RowBytes(format, picture.width);
  const std::size_t stride = std::max(picture.stride, row_bytes);
  const auto rows = static_cast<std::size_t>(picture.height);
  if (auto why = WhyNotPicture(format, picture, row_bytes, stride)) return Fail(Code::Protocol, *std::move(why));
  const auto width = static_cast<std::size_t>(picture.width);
  Samples samples(width * rows);
  for (std::size_t y = 0; y < rows; ++y) {
    UnpackRow(format, picture.bytes.data() + y * stride, picture.width, samples.data() + y * width);
  }
  return samples;
}

Result<std::shared_ptr<const Samples>> LumaReader::Read(const RawFormat& format, const RawPicture& picture) {
  flawed_ = false;
  if (!CanBe(format, picture)) return Fail(Code::InvalidArgument, "there is no such picture format");
  auto samples = format.packing == Packing::Jpeg ? ReadJpeg(picture) : Unpack(format, picture);
  if (!samples) return PassOn(samples);
  if (format.mosaic != Mosaic::None) AverageMosaic(*samples, picture.width, picture.height);
  if (format.limited && format.bits == 8) StretchLimited(*samples);
  return std::make_shared<const Samples>(*std::move(samples));
}

}  // namespace lensd::drivers::pixels
