// Pictures of the simulated camera as payloads with headers.
#include <turbojpeg.h>

#include <algorithm>
#include <utility>

#include "sim/devices/uvc_stream.h"

namespace lensd::sim::devices {
namespace {

constexpr std::size_t kHeader = 2;
constexpr std::uint8_t kFrameBit = 0x01, kEndOfFrame = 0x02, kError = 0x40, kEndOfHeader = 0x80;
constexpr int kQuality = 95;

bool Takes(int& count) {
  if (count <= 0) return false;
  --count;
  return true;
}

}  // namespace

struct UvcStream::Encoder {
  Encoder() : handle(tjInitCompress()) {}
  ~Encoder() { tjDestroy(handle); }
  tjhandle handle;
  std::vector<std::uint8_t> grey;
};

UvcStream::UvcStream(UvcModel& model) : model_(model), encoder_(std::make_unique<Encoder>()) {}
UvcStream::~UvcStream() {
  Stop();
}

void UvcStream::Stop() {
  if (std::exchange(streaming_, false)) (void)model_.camera().Stop();
  picture_.clear();
  sent_ = 0;
}

std::vector<std::uint8_t> UvcStream::Encode(const drivers::Frame& frame) {
  const auto& samples = *frame.samples;
  const int shift = frame.bits - 8;
  std::vector<std::uint8_t> bytes;
  if (model_.grey()) {
    const int bits = model_.options().grey_bits;
    for (const std::uint16_t sample : samples) {
      const int word = bits > frame.bits ? sample << (bits - frame.bits) : sample >> (frame.bits - bits);
      bytes.push_back(static_cast<std::uint8_t>(word));
      bytes.push_back(static_cast<std::uint8_t>(word >> 8));
    }
    return bytes;
  }
  if (!model_.mjpeg()) {
    bytes.resize(2 * samples.size(), 0x80);
    for (std::size_t i = 0; i < samples.size(); ++i) bytes[2 * i] = static_cast<std::uint8_t>(samples[i] >> shift);
    return bytes;
  }
  auto& grey = encoder_->grey;
  grey.resize(samples.size());
  std::ranges::transform(samples, grey.begin(), [&](std::uint16_t s) { return static_cast<std::uint8_t>(s >> shift); });
  bytes.resize(tjBufSize(frame.width, frame.height, TJSAMP_GRAY));
  unsigned char* out = bytes.data();
  unsigned long length = bytes.size();
  const int failed = tjCompress2(encoder_->handle, grey.data(), frame.width, 0, frame.height, TJPF_GRAY, &out, &length,
                                 TJSAMP_GRAY, kQuality, TJFLAG_NOREALLOC);
  bytes.resize(failed == 0 ? length : 0);
  return bytes;
}

Result<std::optional<std::vector<std::uint8_t>>> UvcStream::Next(std::size_t most) {
  if (commits_ != model_.commits()) {
    commits_ = model_.commits();
    picture_.clear();
    sent_ = 0;
  }
  if (!streaming_) {
    if (auto started = model_.camera().Start(); !started) return PassOn(started);
    streaming_ = true;
  }
  if (sent_ == picture_.size()) {
    auto frame = model_.camera().Poll();
    if (!frame) return PassOn(frame);
    if (!*frame) return std::nullopt;
    picture_ = Encode(**frame);
    sent_ = 0;
    frame_bit_ = !frame_bit_;
  }
  const std::size_t take = std::min(most - kHeader, picture_.size() - sent_);
  const bool last = sent_ + take == picture_.size();
  std::uint8_t flags = kEndOfHeader;
  if (frame_bit_) flags |= kFrameBit;
  if (last) flags |= kEndOfFrame;
  if (Takes(faults_.flagged)) flags |= kError;
  std::vector<std::uint8_t> payload = {kHeader, flags};
  if (Takes(faults_.garbled)) payload[0] = 0xFF;
  const auto from = picture_.begin() + static_cast<std::ptrdiff_t>(sent_);
  payload.insert(payload.end(), from, from + static_cast<std::ptrdiff_t>(take));
  sent_ += take;
  if (Takes(faults_.dropped)) return Next(most);
  return payload;
}

}  // namespace lensd::sim::devices
