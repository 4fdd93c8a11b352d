// JPEG pictures as webcams send them: bytes too many, no end marker, cut, or changed on their way. What is whole by how
// the test made it has to be shown bit for bit as the good picture; TurboJPEG says of the rest whether it is clean.
#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <memory>
#include <random>
#include <string>

#include "drivers/pixels/colour.h"
#include "drivers/pixels/jpeg.h"
#include "drivers/pixels/luma.h"

namespace lensd::drivers::pixels {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr int kWide = 64, kHigh = 48;

Bytes Load(const std::string& name) {
  std::ifstream file(std::string(LENSD_SOURCE_DIR) + "/tests/drivers/pixels/jpegs/" + name + ".jpg", std::ios::binary);
  EXPECT_TRUE(file) << name;
  return {std::istreambuf_iterator<char>(file), {}};
}

int Draws(int usual) {
  const char* level = std::getenv("LENSD_TEST_LEVEL");
  return level != nullptr && std::string(level) == "long" ? 100 * usual : usual;
}

/// The other decoder, which has nothing but a return value and words.
struct Judged {
  bool clean = false;
  Bytes samples;
};
Judged ByTurboJpeg(const Bytes& jpeg) {
  const std::unique_ptr<void, int (*)(tjhandle)> decoder(tjInitDecompress(), tjDestroy);
  Judged judged{.samples = Bytes(static_cast<std::size_t>(kWide * kHigh))};
  int width = 0, height = 0, subsampling = 0, colours = 0;
  judged.clean =
      tjDecompressHeader3(decoder.get(), jpeg.data(), jpeg.size(), &width, &height, &subsampling, &colours) == 0 &&
      width == kWide && height == kHigh &&
      tjDecompress2(decoder.get(), jpeg.data(), jpeg.size(), judged.samples.data(), kWide, 0, kHigh, TJPF_GRAY, 0) == 0;
  return judged;
}

/// Where the coded picture begins, and its markers: restarts and the end.
struct Layout {
  std::size_t scan = 0;
  std::vector<std::size_t> markers;
};
Layout LayoutOf(const Bytes& jpeg) {
  Layout layout;
  for (std::size_t i = 0; i + 1 < jpeg.size(); ++i) {
    if (jpeg[i] != 0xFF) continue;
    const std::uint8_t marker = jpeg[i + 1];
    if (layout.scan == 0 && marker == 0xDA) layout.scan = i + 2 + 256u * jpeg[i + 2] + jpeg[i + 3];
    if (layout.scan > 0 && ((marker >= 0xD0 && marker <= 0xD7) || marker == 0xD9)) layout.markers.push_back(i);
  }
  return layout;
}

TEST(JpegDamage, WhatWebcamsAreKnownFor) {
  const auto good = DecodeJpeg(Load("good"), kWide, kHigh, 1);
  const auto colours = DecodeJpeg(Load("good"), kWide, kHigh, 3);
  ASSERT_TRUE(good && colours);
  EXPECT_FALSE(good->flawed);
  EXPECT_EQ(good->samples, ByTurboJpeg(Load("good")).samples);
  for (const char* name : {"one-extra", "extra-before-restarts", "extra-before-end", "no-end"}) {
    const auto shown = DecodeJpeg(Load(name), kWide, kHigh, 1);
    ASSERT_TRUE(shown) << name << ": " << shown.error().message;
    EXPECT_TRUE(shown->flawed) << name;
    EXPECT_EQ(shown->samples, good->samples) << name;
    EXPECT_EQ(DecodeJpeg(Load(name), kWide, kHigh, 3)->samples, colours->samples) << name;
    const Bytes bytes = Load(name);
    LumaReader reader;
    EXPECT_TRUE(reader.Read({Packing::Jpeg}, {bytes, kWide, kHigh}));
    EXPECT_TRUE(reader.flawed());
    EXPECT_TRUE(MakerOfColour({Packing::Jpeg}, {bytes, kWide, kHigh})());
  }
  const auto cut = DecodeJpeg(Load("cut"), kWide, kHigh, 1);
  ASSERT_FALSE(cut);
  EXPECT_EQ(cut.error().message, "damaged: Premature end of JPEG file");
}

TEST(JpegDamage, BytesTooManyBeforeAnyMarkerShow) {
  const Bytes good = Load("good");
  const auto expected = DecodeJpeg(good, kWide, kHigh, 1)->samples;
  const Layout layout = LayoutOf(good);
  ASSERT_GT(layout.markers.size(), 2u);
  std::mt19937 random(6);
  int flawed = 0;
  for (int i = 0; i < Draws(300); ++i) {
    Bytes jpeg = good;
    for (std::size_t marker = layout.markers.size(); marker-- > 0;) {
      if (marker > 0 && random() % 2 == 0) continue;
      Bytes extra(1 + random() % 6);
      for (auto& byte : extra) byte = static_cast<std::uint8_t>(random() % 255);
      jpeg.insert(jpeg.begin() + static_cast<std::ptrdiff_t>(layout.markers[marker]), extra.begin(), extra.end());
    }
    if (random() % 4 == 0) jpeg.resize(jpeg.size() - 1 - random() % 2);
    const auto shown = DecodeJpeg(jpeg, kWide, kHigh, 1);
    ASSERT_TRUE(shown) << i << ": " << shown.error().message;
    EXPECT_EQ(shown->samples, expected) << i;
    flawed += shown->flawed ? 1 : 0;
  }
  // libjpeg does not remark on what it has read ahead of a restart marker.
  EXPECT_GT(flawed, 9 * Draws(300) / 10);
}

TEST(JpegDamage, ACutPictureIsDroppedUnlessNothingIsMissing) {
  const Bytes good = Load("good");
  const auto expected = DecodeJpeg(good, kWide, kHigh, 1)->samples;
  int shown = 0;
  for (std::size_t size = 0; size < good.size(); ++size) {
    const auto cut = DecodeJpeg(std::span(good).first(size), kWide, kHigh, 1);
    shown += cut ? 1 : 0;
    if (cut) {
      EXPECT_EQ(cut->samples, expected) << size;
    } else {
      EXPECT_TRUE(cut.error().message.starts_with("damaged: ")) << cut.error().message;
    }
  }
  EXPECT_GE(shown, 2);  // half an end marker, and none
  EXPECT_LE(shown, 4);
}

TEST(JpegDamage, OnlyWhatTheOtherDecoderTakesIsClean) {
  const Bytes good = Load("good");
  const Layout layout = LayoutOf(good);
  std::mt19937 random(7);
  int clean = 0, flawed = 0, dropped = 0;
  for (int i = 0; i < Draws(2000); ++i) {
    Bytes jpeg = good;
    const std::size_t first = random() % 8 == 0 ? 0 : layout.scan;  // now and then in the headers
    const auto at = static_cast<std::ptrdiff_t>(first + random() % (good.size() - first));
    const auto count = static_cast<std::ptrdiff_t>(1 + random() % 6);
    switch (random() % 3) {
      case 0:
        jpeg[static_cast<std::size_t>(at)] ^= static_cast<std::uint8_t>(1u << random() % 8);
        break;
      case 1:
        for (std::ptrdiff_t j = 0; j < count; ++j)
          jpeg.insert(jpeg.begin() + at, static_cast<std::uint8_t>(random() % 256));
        break;
      default:
        jpeg.erase(jpeg.begin() + at, jpeg.begin() + std::min(at + count, std::ssize(jpeg)));
    }
    const auto ours = DecodeJpeg(jpeg, kWide, kHigh, 1);
    const Judged other = ByTurboJpeg(jpeg);
    EXPECT_EQ(ours && !ours->flawed, other.clean) << i << (ours ? "" : ": " + ours.error().message);
    if (ours && other.clean) {
      EXPECT_EQ(ours->samples, other.samples) << i;
    }
    ++(!ours ? dropped : ours->flawed ? flawed : clean);
  }
  EXPECT_GT(clean, 0);
  EXPECT_GT(flawed, 0);
  EXPECT_GT(dropped, 0);
}

}  // namespace
}  // namespace lensd::drivers::pixels
