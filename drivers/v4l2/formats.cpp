// Which V4L2 formats can become luminance, best first, and how each is laid out.
#include "formats.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <iterator>

// Newer than some kernels' headers.
#ifndef V4L2_PIX_FMT_Y12P
#define V4L2_PIX_FMT_Y12P v4l2_fourcc('Y', '1', '2', 'P')
#endif
#ifndef V4L2_PIX_FMT_Y14P
#define V4L2_PIX_FMT_Y14P v4l2_fourcc('Y', '1', '4', 'P')
#endif

namespace lensd::drivers::v4l2 {
namespace {

using drivers::pixels::Chroma;
using drivers::pixels::Mosaic;
using drivers::pixels::Packing;
using drivers::pixels::RawFormat;

struct Known {
  std::uint32_t code;
  RawFormat raw;
};

constexpr RawFormat Of(Mosaic mosaic, Packing packing, int bits) {
  return {.packing = packing, .bits = bits, .mosaic = mosaic};
}

/// The best first.
constexpr Known kKnown[] = {
    {V4L2_PIX_FMT_Y16, {Packing::Words, 16}},
    {V4L2_PIX_FMT_Y14, {Packing::Words, 14}},
    {V4L2_PIX_FMT_Y14P, {Packing::Csi2, 14}},
    {V4L2_PIX_FMT_Y12, {Packing::Words, 12}},
    {V4L2_PIX_FMT_Y12P, {Packing::Csi2, 12}},
    {V4L2_PIX_FMT_Y10, {Packing::Words, 10}},
    {V4L2_PIX_FMT_Y10P, {Packing::Csi2, 10}},
    {V4L2_PIX_FMT_GREY, {}},
    {V4L2_PIX_FMT_SBGGR16, Of(Mosaic::Bggr, Packing::Words, 16)},
    {V4L2_PIX_FMT_SGBRG16, Of(Mosaic::Gbrg, Packing::Words, 16)},
    {V4L2_PIX_FMT_SGRBG16, Of(Mosaic::Grbg, Packing::Words, 16)},
    {V4L2_PIX_FMT_SRGGB16, Of(Mosaic::Rggb, Packing::Words, 16)},
    {V4L2_PIX_FMT_SBGGR14, Of(Mosaic::Bggr, Packing::Words, 14)},
    {V4L2_PIX_FMT_SGBRG14, Of(Mosaic::Gbrg, Packing::Words, 14)},
    {V4L2_PIX_FMT_SGRBG14, Of(Mosaic::Grbg, Packing::Words, 14)},
    {V4L2_PIX_FMT_SRGGB14, Of(Mosaic::Rggb, Packing::Words, 14)},
    {V4L2_PIX_FMT_SBGGR14P, Of(Mosaic::Bggr, Packing::Csi2, 14)},
    {V4L2_PIX_FMT_SGBRG14P, Of(Mosaic::Gbrg, Packing::Csi2, 14)},
    {V4L2_PIX_FMT_SGRBG14P, Of(Mosaic::Grbg, Packing::Csi2, 14)},
    {V4L2_PIX_FMT_SRGGB14P, Of(Mosaic::Rggb, Packing::Csi2, 14)},
    {V4L2_PIX_FMT_SBGGR12, Of(Mosaic::Bggr, Packing::Words, 12)},
    {V4L2_PIX_FMT_SGBRG12, Of(Mosaic::Gbrg, Packing::Words, 12)},
    {V4L2_PIX_FMT_SGRBG12, Of(Mosaic::Grbg, Packing::Words, 12)},
    {V4L2_PIX_FMT_SRGGB12, Of(Mosaic::Rggb, Packing::Words, 12)},
    {V4L2_PIX_FMT_SBGGR12P, Of(Mosaic::Bggr, Packing::Csi2, 12)},
    {V4L2_PIX_FMT_SGBRG12P, Of(Mosaic::Gbrg, Packing::Csi2, 12)},
    {V4L2_PIX_FMT_SGRBG12P, Of(Mosaic::Grbg, Packing::Csi2, 12)},
    {V4L2_PIX_FMT_SRGGB12P, Of(Mosaic::Rggb, Packing::Csi2, 12)},
    {V4L2_PIX_FMT_SBGGR10, Of(Mosaic::Bggr, Packing::Words, 10)},
    {V4L2_PIX_FMT_SGBRG10, Of(Mosaic::Gbrg, Packing::Words, 10)},
    {V4L2_PIX_FMT_SGRBG10, Of(Mosaic::Grbg, Packing::Words, 10)},
    {V4L2_PIX_FMT_SRGGB10, Of(Mosaic::Rggb, Packing::Words, 10)},
    {V4L2_PIX_FMT_SBGGR10P, Of(Mosaic::Bggr, Packing::Csi2, 10)},
    {V4L2_PIX_FMT_SGBRG10P, Of(Mosaic::Gbrg, Packing::Csi2, 10)},
    {V4L2_PIX_FMT_SGRBG10P, Of(Mosaic::Grbg, Packing::Csi2, 10)},
    {V4L2_PIX_FMT_SRGGB10P, Of(Mosaic::Rggb, Packing::Csi2, 10)},
    {V4L2_PIX_FMT_SBGGR8, Of(Mosaic::Bggr, Packing::Bytes, 8)},
    {V4L2_PIX_FMT_SGBRG8, Of(Mosaic::Gbrg, Packing::Bytes, 8)},
    {V4L2_PIX_FMT_SGRBG8, Of(Mosaic::Grbg, Packing::Bytes, 8)},
    {V4L2_PIX_FMT_SRGGB8, Of(Mosaic::Rggb, Packing::Bytes, 8)},
    {V4L2_PIX_FMT_NV12, {.limited = true, .chroma = Chroma::CbCr}},
    {V4L2_PIX_FMT_NV12M, {.limited = true}},  // its colour lies in another buffer
    {V4L2_PIX_FMT_NV21, {.limited = true, .chroma = Chroma::CrCb}},
    {V4L2_PIX_FMT_YUV420, {.limited = true, .chroma = Chroma::Planes}},
    {V4L2_PIX_FMT_YUYV, {.packing = Packing::Yuyv, .limited = true}},
    {V4L2_PIX_FMT_UYVY, {.packing = Packing::Uyvy, .limited = true}},
    {V4L2_PIX_FMT_MJPEG, {.packing = Packing::Jpeg}},
    {V4L2_PIX_FMT_JPEG, {.packing = Packing::Jpeg}},
};

}  // namespace

std::optional<RawFormat> RawFormatOf(std::uint32_t code) {
  const auto* known = std::ranges::find(kKnown, code, &Known::code);
  if (known == std::end(kKnown)) return std::nullopt;
  return known->raw;
}

std::optional<std::uint32_t> BestOf(const std::vector<std::uint32_t>& offered) {
  for (const Known& known : kKnown) {
    if (std::ranges::find(offered, known.code) != offered.end()) return known.code;
  }
  return std::nullopt;
}

std::string NameOfFormat(std::uint32_t code) {
  std::string name;
  for (int shift = 0; shift < 32; shift += 8) name += static_cast<char>((code >> shift) & 0x7f);
  while (!name.empty() && name.back() == ' ') name.pop_back();
  return name;
}

std::uint32_t FormatNamed(const std::string& name) {
  std::string four = name;
  four.resize(4, ' ');
  std::uint32_t code = 0;
  for (std::size_t i = 0; i < 4; ++i) code |= std::uint32_t{static_cast<unsigned char>(four[i])} << (8 * i);
  return code;
}

bool IsLinear(const RawFormat& format) {
  return format.packing != Packing::Jpeg && !format.limited;
}

std::string WhatFits(const std::vector<std::uint32_t>& offered) {
  std::string names;
  for (const std::uint32_t code : offered) {
    if (RawFormatOf(code)) names += (names.empty() ? "" : ", ") + NameOfFormat(code);
  }
  return names.empty() ? "" : "; of those it has, these can: " + names;
}

}  // namespace lensd::drivers::v4l2
