// Every raw format against samples packed here, by the formats' definitions.
#include "drivers/pixels/luma.h"

#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <numeric>

namespace lensd::drivers::pixels {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Samples = std::vector<std::uint16_t>;

Samples Read(const RawFormat& format, const Bytes& bytes, int width, int height, std::size_t stride = 0) {
  LumaReader reader;
  const auto read = reader.Read(format, {bytes, width, height, stride});
  EXPECT_TRUE(read.has_value()) << read.error().message;
  return read ? **read : Samples();
}

TEST(Luma, Bytes) {
  EXPECT_EQ(Read({}, {1, 2, 3, 4, 5, 6}, 3, 2), (Samples{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(Read({}, {1, 2, 3, 99, 4, 5, 6}, 3, 2, 4), (Samples{1, 2, 3, 4, 5, 6}));
}

TEST(Luma, Words) {
  const RawFormat ten{Packing::Words, 10};
  EXPECT_EQ(Read(ten, {0x01, 0x02, 0xff, 0x03}, 2, 1), (Samples{0x201, 0x3ff}));
  // Bits that should not be there do not make a sample brighter than white.
  EXPECT_EQ(Read(ten, {0xff, 0xff}, 1, 1), (Samples{0x3ff}));
  EXPECT_EQ(Read({Packing::Words, 16}, {0xff, 0xff, 0x34, 0x12}, 2, 1), (Samples{0xffff, 0x1234}));
}

/// V4L2's pixel format documents: SRGGB10P, SRGGB12P, SRGGB14P.
TEST(Luma, PackedCsi2) {
  EXPECT_EQ(Read({Packing::Csi2, 10}, {0x00, 0x40, 0x80, 0xff, 0b11100100}, 4, 1),
            (Samples{0x000, 0x101, 0x202, 0x3ff}));
  EXPECT_EQ(Read({Packing::Csi2, 12}, {0x12, 0xab, 0xc3}, 2, 1), (Samples{0x123, 0xabc}));
  // Samples 0x0001, 0x1002, 0x2003, 0x3fff: low six bits 000001, 000010, 000011, 111111.
  EXPECT_EQ(Read({Packing::Csi2, 14}, {0x00, 0x40, 0x80, 0xff, 0b10000001, 0b00110000, 0b11111100}, 4, 1),
            (Samples{0x0001, 0x1002, 0x2003, 0x3fff}));
}

TEST(Luma, PackedCsi2InOddWidths) {
  EXPECT_EQ(RowBytes({Packing::Csi2, 10}, 5), 10u);
  EXPECT_EQ(Read({Packing::Csi2, 10}, {1, 2, 3, 4, 0, 5, 0, 0, 0, 1}, 5, 1), (Samples{4, 8, 12, 16, 21}));
  EXPECT_EQ(Read({Packing::Csi2, 12}, {1, 2, 0, 3, 0, 0x07}, 3, 1), (Samples{16, 32, 55}));
}

TEST(Luma, PackedYuv) {
  EXPECT_EQ(Read({Packing::Yuyv}, {10, 128, 20, 128}, 2, 1), (Samples{10, 20}));
  EXPECT_EQ(Read({Packing::Uyvy}, {128, 10, 128, 20}, 2, 1), (Samples{10, 20}));
}

TEST(Luma, LimitedRangeIsStretched) {
  EXPECT_EQ(Read({.limited = true}, {0, 16, 125, 126, 235, 255}, 6, 1), (Samples{0, 0, 127, 128, 255, 255}));
}

TEST(Luma, AFlatColourOfAnyMosaicIsFlat) {
  // R = 200, G = 100, B = 40: (200 + 2 * 100 + 40) / 4 = 110.
  const Bytes rggb = {200, 100, 200, 100, 40, 100, 200, 100, 200};
  const Bytes grbg = {100, 200, 100, 40, 100, 40, 100, 200, 100};
  EXPECT_EQ(Read({.mosaic = Mosaic::Rggb}, {40, 100, 40, 100, 200, 100, 40, 100, 40}, 3, 3), Samples(9, 110));
  EXPECT_EQ(Read({.mosaic = Mosaic::Rggb}, grbg, 3, 3), Samples(9, 110));
  EXPECT_EQ(Read({.mosaic = Mosaic::Rggb}, rggb, 3, 3), Samples(9, 110));
}

TEST(Luma, MosaicAveragesFourNeighbours) {
  EXPECT_EQ(Read({Packing::Words, 12, Mosaic::Rggb}, {4, 0, 8, 0, 12, 0, 0, 1, 0, 1, 0, 1}, 3, 2),
            (Samples{131, 133, 133, 131, 133, 133}));
}

Bytes JpegOf(const Bytes& grey, int width, int height) {
  const tjhandle handle = tjInitCompress();
  unsigned char* out = nullptr;
  unsigned long size = 0;
  EXPECT_EQ(tjCompress2(handle, grey.data(), width, 0, height, TJPF_GRAY, &out, &size, TJSAMP_GRAY, 95, 0), 0);
  Bytes bytes(out, out + size);
  tjFree(out);
  tjDestroy(handle);
  return bytes;
}

TEST(Luma, Jpeg) {
  Bytes grey(64 * 48);
  for (std::size_t i = 0; i < grey.size(); ++i) grey[i] = static_cast<std::uint8_t>(40 + 2 * (i % 64));
  Bytes jpeg = JpegOf(grey, 64, 48);
  const Samples samples = Read({Packing::Jpeg}, jpeg, 64, 48);
  ASSERT_EQ(samples.size(), grey.size());
  for (std::size_t i = 0; i < grey.size(); ++i) ASSERT_NEAR(samples[i], grey[i], 4) << i;

  LumaReader reader;
  EXPECT_EQ(reader.Read({Packing::Jpeg}, {jpeg, 48, 64}).error().code, Code::Protocol);
  EXPECT_EQ(reader.Read({Packing::Jpeg}, {Bytes(100, 7), 64, 48}).error().code, Code::Protocol);
  jpeg.resize(jpeg.size() * 2 / 3);
  EXPECT_EQ(reader.Read({Packing::Jpeg}, {jpeg, 64, 48}).error().code, Code::Protocol);
  EXPECT_EQ(reader.Read({Packing::Jpeg}, {Bytes(), 64, 48}).error().code, Code::Protocol);
}

/// Cameras that send motion JPEG leave out the tables every one of them uses.
TEST(Luma, JpegWithoutHuffmanTables) {
  const Bytes grey(64 * 48, 90);
  Bytes jpeg = JpegOf(grey, 64, 48);
  for (std::size_t i = 2; i + 4 < jpeg.size() && jpeg[i] == 0xff && jpeg[i + 1] != 0xda;) {
    const std::size_t length = 2u + (std::size_t{jpeg[i + 2]} << 8 | jpeg[i + 3]);
    const auto begin = jpeg.begin() + static_cast<std::ptrdiff_t>(i);
    if (jpeg[i + 1] == 0xc4) {
      jpeg.erase(begin, begin + static_cast<std::ptrdiff_t>(length));
    } else {
      i += length;
    }
  }
  const Samples samples = Read({Packing::Jpeg}, jpeg, 64, 48);
  ASSERT_EQ(samples.size(), grey.size());
  EXPECT_NEAR(samples[100], 90, 2);
}

TEST(Luma, RefusesWhatCannotBe) {
  LumaReader reader;
  const Bytes bytes(100);
  EXPECT_EQ(reader.Read({}, {bytes, 11, 10}).error().code, Code::Protocol);
  EXPECT_EQ(reader.Read({}, {bytes, 10, 10, 11}).error().code, Code::Protocol);
  EXPECT_EQ(reader.Read({}, {bytes, 0, 10}).error().code, Code::InvalidArgument);
  EXPECT_EQ(reader.Read({Packing::Csi2, 11}, {bytes, 8, 2}).error().code, Code::InvalidArgument);
  EXPECT_EQ(reader.Read({Packing::Words, 17}, {bytes, 8, 2}).error().code, Code::InvalidArgument);
  EXPECT_EQ(reader.Read({.packing = Packing::Yuyv, .mosaic = Mosaic::Rggb}, {bytes, 8, 2}).error().code,
            Code::InvalidArgument);
  EXPECT_EQ(reader.Read({.mosaic = Mosaic::Rggb}, {Bytes(1, 5), 1, 1}).value()->front(), 5);
}

}  // namespace
}  // namespace lensd::drivers::pixels
