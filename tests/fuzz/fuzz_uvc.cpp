// What a USB camera sends: descriptors, payloads, status packets. The first byte says which.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "axis_control.h"
#include "descriptors.h"
#include "discovery.h"
#include "frame_assembler.h"
#include "stream_choice.h"

namespace {

using namespace lensd::drivers::uvc;

void Describe(std::span<const std::uint8_t> bytes) {
  const auto functions = ParseConfiguration(bytes);
  if (!functions) return;
  for (const VideoFunction& function : *functions) {
    for (const auto format : {PixelFormat::Yuyv, PixelFormat::Mjpeg}) {
      CameraConfig config;
      config.format = format;
      config.frame_rate_hz = 30.0;
      const auto choice = Choose(function, config);
      if (choice && (choice->width <= 0 || choice->height <= 0 || choice->interval == 0)) __builtin_trap();
    }
  }
}

/// Payloads, each behind a byte of length.
void Stream(std::span<const std::uint8_t> bytes, PixelFormat pixels) {
  constexpr std::size_t kBytes = 64;
  lensd::SteppedClock clock;
  FrameAssembler frames(clock, pixels, kBytes);
  std::uint64_t last = 0;
  bool any = false;
  while (!bytes.empty()) {
    const std::size_t length = std::min<std::size_t>(bytes[0], bytes.size() - 1);
    if (bytes[0] == 0xFF) frames.OnLoss();
    frames.OnPayload(bytes.subspan(1, length));
    bytes = bytes.subspan(1 + length);
    if (auto frame = frames.Take()) {
      if (frame->bytes.size() > kBytes || (any && frame->sequence <= last)) __builtin_trap();
      if (pixels == PixelFormat::Yuyv && frame->bytes.size() != kBytes) __builtin_trap();
      last = frame->sequence;
      any = true;
      frames.Recycle(std::move(frame->bytes));
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::span<const std::uint8_t> rest(data + 1, size - 1);
  switch (data[0] % 5) {
    case 0:
      Describe(rest);
      break;
    case 1:
      Describe(ActiveConfiguration(rest, "1"));
      break;
    case 2:
      Stream(rest, PixelFormat::Yuyv);
      break;
    case 3:
      Stream(rest, PixelFormat::Mjpeg);
      break;
    default:
      (void)ParseStatus(rest);
  }
  return 0;
}
