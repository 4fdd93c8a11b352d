// Frames come through shared memory, and no sample is above what its bits allow.
#include <fcntl.h>
#include <unistd.h>
#include <algorithm>

#include "frame_memory.h"
#include "odd_device.h"
#include "varlink/base64.h"

namespace lensd::drivers::process {

TEST(Frames, AreCutToTheirBitsWithTheirColours) {
  auto device = OpenOdd("");
  ASSERT_TRUE(device.has_value());
  Camera& camera = *device->camera;
  ASSERT_TRUE(camera.Start().has_value());
  std::optional<Frame> first;
  for (std::uint16_t number = 1; number <= 100; ++number) {
    const auto frame = camera.Poll();
    ASSERT_TRUE(frame.has_value()) << frame.error().message;
    ASSERT_TRUE(frame->has_value());
    ASSERT_EQ((*frame)->samples->size(), 1200u);
    for (std::size_t i = 0; i < 1200; ++i) {
      ASSERT_EQ((*(*frame)->samples)[i], std::min<std::uint16_t>(static_cast<std::uint16_t>(1000 * number + i), 1023));
    }
    EXPECT_EQ((*frame)->sequence, number);
    EXPECT_EQ(camera.counters().frames, number);
    const auto colours = (*frame)->colour();
    ASSERT_NE(colours, nullptr);
    ASSERT_EQ(colours->size(), 3600u);
    EXPECT_EQ((*colours)[3599], std::min<std::uint16_t>(static_cast<std::uint16_t>(1000 * number + 3599), 1023));
    if (!first) first = **frame;
  }
  EXPECT_EQ(first->colour(), nullptr) << "the driver keeps the colours of the newest frames alone";
  *device = {};
  EXPECT_EQ(first->colour(), nullptr) << "and none when it has ended";
}

TEST(Frames, TheirMemoryHasASizeThatNobodyChanges) {
  const auto memory = FrameMemory::Make(2, 5000);
  ASSERT_NE(memory, nullptr);
  EXPECT_NE(ftruncate(memory->descriptor(), 0), 0);
  EXPECT_NE(ftruncate(memory->descriptor(), 1 << 20), 0);
  EXPECT_NE(fcntl(memory->descriptor(), F_ADD_SEALS, F_SEAL_WRITE), 0);
  const std::uint16_t sample = 0x1234;
  ASSERT_EQ(pwrite(memory->descriptor(), &sample, sizeof sample, 5002), 2);
  EXPECT_EQ(*memory->Copy(1, 3), (Samples{0, 0x1234, 0}));
}

TEST(Frames, InlineOnesHaveExactlyTheirSamples) {
  const std::vector<std::uint8_t> bytes = {0x34, 0x12, 0xff, 0x00, 0x00, 0x80};
  const std::string text = varlink::EncodeBase64(bytes);
  const auto samples = InlineSamples(text, 3);
  ASSERT_NE(samples, nullptr);
  EXPECT_EQ(*samples, (Samples{0x1234, 0x00ff, 0x8000}));
  for (const std::size_t wrong : {0, 1, 2, 4, 1'000'000}) EXPECT_EQ(InlineSamples(text, wrong), nullptr) << wrong;
  EXPECT_EQ(InlineSamples("not base64!", 3), nullptr);
}

}  // namespace lensd::drivers::process
