// Pictures made of frames, and frames lent as sealed memory.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>

#include <numeric>

#include "daemon/pictures/frame_loans.h"
#include "daemon/pictures/picture.h"

namespace lensd::daemon {
namespace {

using Samples = std::vector<std::uint16_t>;

/// Samples 0, 1, 2 ... in rows.
drivers::Frame Ramp(int width, int height, int bits) {
  Samples samples(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  std::iota(samples.begin(), samples.end(), std::uint16_t{0});
  drivers::Frame frame;
  frame.width = width;
  frame.height = height;
  frame.bits = bits;
  frame.samples = std::make_shared<const Samples>(std::move(samples));
  return frame;
}

std::vector<int> Words(const Picture& picture) {
  const auto bytes = picture.bytes();
  std::vector<int> words;
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) words.push_back(bytes[i] | bytes[i + 1] << 8);
  return words;
}

PictureWish Wish(Encoding encoding) {
  PictureWish wish;
  wish.encoding = encoding;
  return wish;
}

TEST(Pictures, RawIsTheFrameItself) {
  const drivers::Frame frame = Ramp(8, 4, 16);
  const auto picture = PictureMaker(Wish(Encoding::Raw)).Make(frame);
  ASSERT_TRUE(picture);
  EXPECT_EQ(picture->lent, frame.samples);
  EXPECT_EQ(picture->bytes().size(), 64u);
}

TEST(Pictures, CutsOutWholePixels) {
  PictureWish wish = Wish(Encoding::Raw);
  wish.region = {0.25, 0.5, 0.25, 0.5};
  const auto picture = PictureMaker(wish).Make(Ramp(8, 4, 12));
  ASSERT_TRUE(picture);
  EXPECT_EQ(Words(*picture), (std::vector{18, 19, 26, 27}));
  EXPECT_EQ(picture->window.x, 2);
  EXPECT_EQ(picture->window.y, 2);
  wish.region = {0.999, 0.0, 0.001, 0.001};
  const auto least = PictureMaker(wish).Make(Ramp(8, 4, 12));
  ASSERT_TRUE(least);
  EXPECT_EQ(Words(*least), (std::vector{7}));
}

TEST(Pictures, AveragesWhatBecomesOnePixel) {
  PictureWish wish = Wish(Encoding::Raw);
  wish.scale_to = {4, 100};
  const auto picture = PictureMaker(wish).Make(Ramp(8, 4, 12));
  ASSERT_TRUE(picture);
  EXPECT_EQ(picture->width, 4);
  EXPECT_EQ(picture->height, 2);
  // 0 1 8 9 make 4.5, rounded up.
  EXPECT_EQ(Words(*picture), (std::vector{5, 7, 9, 11, 21, 23, 25, 27}));
}

TEST(Pictures, EightBitsAreRoundedOnce) {
  drivers::Frame frame = Ramp(4096, 1, 12);
  const auto grey = PictureMaker(Wish(Encoding::Gray8)).Make(frame);
  ASSERT_TRUE(grey);
  for (int i = 0; i < 4096; ++i) {
    EXPECT_EQ(grey->bytes()[static_cast<std::size_t>(i)], (2 * i * 255 + 4095) / (2 * 4095)) << i;
  }
  const auto none = PictureMaker(Wish(Encoding::Rgb8)).Make(frame);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, Code::Unsupported);
}

TEST(Pictures, TheHistogramCountsThePartShown) {
  const drivers::Frame frame = Ramp(64, 64, 12);
  const LightSummary all = Summarise(frame, {0, 0, 64, 64});
  EXPECT_EQ(all.histogram, std::vector<std::uint32_t>(64, 64u));
  const LightSummary row = Summarise(frame, {0, 5, 64, 1});
  EXPECT_EQ(row.histogram[5], 64u);
  EXPECT_FALSE(row.sharpness);
}

TEST(FrameLoans, ThreeEachAndBackWhenNobodyHasThem) {
  FrameLoans loans;
  const auto mine = loans.NewBorrower(), another = loans.NewBorrower();
  const std::vector<std::uint8_t> bytes{1, 2, 3};
  std::vector<Descriptor> held;
  for (int i = 0; i < 3; ++i) {
    EXPECT_FALSE(loans.Full(mine));
    auto lent = loans.Lend(mine, bytes);
    ASSERT_TRUE(lent) << lent.error().message;
    held.push_back(*std::move(lent));
  }
  EXPECT_TRUE(loans.Full(mine));
  EXPECT_FALSE(loans.Full(another));
  void* const mapped = mmap(nullptr, 3, PROT_READ, MAP_SHARED, held.back().get(), 0);
  ASSERT_NE(mapped, MAP_FAILED);
  held.pop_back();
  EXPECT_TRUE(loans.Full(mine)) << "it is mapped";
  EXPECT_EQ(static_cast<const std::uint8_t*>(mapped)[2], 3);
  munmap(mapped, 3);
  EXPECT_FALSE(loans.Full(mine));
}

TEST(FrameLoans, NoMoreThanABoundIsLentToAllTogether) {
  FrameLoans loans;
  const std::vector<std::uint8_t> large(FrameLoans::kMostBytes / 4);
  std::vector<Descriptor> held;
  while (held.size() < 10 && !loans.Full(loans.NewBorrower())) {
    auto lent = loans.Lend(loans.NewBorrower(), large);
    ASSERT_TRUE(lent) << lent.error().message;
    held.push_back(*std::move(lent));
  }
  EXPECT_EQ(held.size(), 4u);
  held.pop_back();
  EXPECT_FALSE(loans.Full(loans.NewBorrower()));
}

}  // namespace
}  // namespace lensd::daemon
