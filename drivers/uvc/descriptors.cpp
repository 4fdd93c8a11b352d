// A walk through a configuration descriptor by UVC 1.1, section 3. The bytes come from a device and are not trusted:
// each length is checked before it is used.
#include "descriptors.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "wire.h"

namespace lensd::drivers::uvc {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::uint8_t kInterface = 0x04;
constexpr std::uint8_t kEndpoint = 0x05;
constexpr std::uint8_t kClassInterface = 0x24;
constexpr std::uint8_t kVideo = 0x0E;
constexpr std::uint8_t kControlSubclass = 0x01;
constexpr std::uint8_t kStreamingSubclass = 0x02;
constexpr std::uint16_t kCameraTerminalType = 0x0201;

std::unexpected<Error> TooShort(const char* what) {
  return Fail(Code::Protocol, std::string("the camera's ") + what + " descriptor is shorter than its contents");
}

class Walk {
 public:
  Result<std::vector<VideoFunction>> Run(Bytes bytes) {
    while (!bytes.empty()) {
      const std::size_t length = bytes[0];
      if (bytes.size() < 2 || length < 2 || length > bytes.size()) {
        return Fail(Code::Protocol, "the camera's configuration descriptor is cut short or has a wrong length inside");
      }
      if (auto taken = Take(bytes.first(length)); !taken) return PassOn(taken);
      bytes = bytes.subspan(length);
    }
    return Assemble();
  }

 private:
  Result<void> Take(Bytes one) {
    switch (one[1]) {
      case kInterface:
        return TakeInterface(one);
      case kEndpoint:
        return TakeEndpoint(one);
      case kClassInterface:
        if (one.size() < 3) return TooShort("class-specific");
        if (control_ != nullptr) return TakeControl(one);
        if (stream_ != nullptr) return TakeStreaming(one);
        return {};
      default:
        return {};
    }
  }

  Result<void> TakeInterface(Bytes one) {
    if (one.size() < 9) return TooShort("interface");
    control_ = nullptr;
    stream_ = nullptr;
    format_ = nullptr;
    alternate_ = one[3];
    if (one[5] != kVideo) return {};
    if (one[6] == kControlSubclass) {
      control_ = &controls_[one[2]];
      control_->interface = one[2];
    } else if (one[6] == kStreamingSubclass) {
      stream_ = &streams_[one[2]];
      stream_->number = one[2];
    }
    return {};
  }

  Result<void> TakeEndpoint(Bytes one) {
    if (one.size() < 7) return TooShort("endpoint");
    const std::uint8_t type = one[3] & 0x03;
    const std::uint32_t size = FromLittle(one.subspan(4, 2));
    const bool in = (one[2] & 0x80) != 0;
    if (control_ != nullptr && in && type == 3) {
      control_->status_endpoint = one[2];
      control_->status_bytes = static_cast<std::uint16_t>(size & 0x7FF);
    }
    if (stream_ != nullptr && in && (type == 1 || type == 2)) {
      const std::uint32_t packet = (size & 0x7FF) * (1 + (size >> 11 & 3));
      stream_->settings.push_back({alternate_, one[2], type == 1, packet});
    }
    return {};
  }

  Result<void> TakeControl(Bytes one) {
    constexpr std::uint8_t kHeader = 0x01, kInputTerminal = 0x02, kProcessingUnit = 0x05;
    if (one[2] == kHeader) {
      if (one.size() < 12 || one.size() < 12u + one[11]) return TooShort("VideoControl header");
      control_->version = static_cast<std::uint16_t>(FromLittle(one.subspan(3, 2)));
      const Bytes numbers = one.subspan(12, one[11]);
      members_[control_->interface].assign(numbers.begin(), numbers.end());
    } else if (one[2] == kInputTerminal) {
      if (one.size() < 8) return TooShort("input terminal");
      if (FromLittle(one.subspan(4, 2)) != kCameraTerminalType) return {};
      if (one.size() < 15 || one.size() < 15u + one[14]) return TooShort("camera terminal");
      // Bits beyond the 32nd have no use yet.
      const std::size_t length = std::min<std::size_t>(one[14], 4);
      control_->terminals.push_back({one[3], FromLittle(one.subspan(15, length))});
    } else if (one[2] == kProcessingUnit) {
      if (one.size() < 8 || one.size() < 8u + one[7]) return TooShort("processing unit");
      const std::size_t length = std::min<std::size_t>(one[7], 4);
      control_->units.push_back({one[3], one[4], FromLittle(one.subspan(8, length))});
    }
    return {};
  }

  Result<void> TakeStreaming(Bytes one) {
    constexpr std::uint8_t kUncompressed = 0x04, kUncompressedFrame = 0x05, kMjpeg = 0x06, kMjpegFrame = 0x07,
                           kStream = 0x0A, kDv = 0x0C, kColour = 0x0D, kFrameBased = 0x10, kStreamBased = 0x12;
    switch (one[2]) {
      case kUncompressed:
        if (one.size() < 27) return TooShort("uncompressed format");
        format_ = nullptr;
        if (const auto* known = FormatOfGuid(one.subspan(5).first<16>())) {
          AddFormat({one[3], known->format, one[22], 0, {}});
        }
        return {};
      case kMjpeg:
        if (one.size() < 11) return TooShort("MJPEG format");
        AddFormat({one[3], PixelFormat::Mjpeg, one[6], 0, {}});
        return {};
      case kUncompressedFrame:
      case kMjpegFrame:
        return TakeFrame(one);
      case kColour:
        if (one.size() < 6) return TooShort("colour matching");
        if (format_ != nullptr) format_->transfer_characteristics = one[4];
        return {};
      case kStream:
      case kDv:
      case kFrameBased:
      case kStreamBased:
        // Formats this driver does not know. Their frames have subtypes of their own; a colour descriptor has not.
        format_ = nullptr;
        return {};
      default:
        return {};
    }
  }

  void AddFormat(StreamFormat format) {
    stream_->formats.push_back(std::move(format));
    format_ = &stream_->formats.back();
  }

  Result<void> TakeFrame(Bytes one) {
    if (one.size() < 26) return TooShort("frame");
    const std::size_t listed = one[25] == 0 ? 3 : one[25];
    if (one.size() < 26 + 4 * listed) return TooShort("frame");
    if (format_ == nullptr) return {};
    StreamFrame frame;
    frame.index = one[3];
    frame.width = static_cast<int>(FromLittle(one.subspan(5, 2)));
    frame.height = static_cast<int>(FromLittle(one.subspan(7, 2)));
    frame.default_interval = FromLittle(one.subspan(21, 4));
    frame.continuous = one[25] == 0;
    // Of a continuous range the third number is the step.
    for (std::size_t i = 0; i < (frame.continuous ? 2 : listed); ++i) {
      frame.intervals.push_back(FromLittle(one.subspan(26 + 4 * i, 4)));
    }
    if (frame.width > 0 && frame.height > 0) format_->frames.push_back(std::move(frame));
    return {};
  }

  std::vector<VideoFunction> Assemble() {
    std::vector<VideoFunction> functions;
    for (auto& [number, function] : controls_) {
      for (const std::uint8_t member : members_[number]) {
        if (const auto found = streams_.find(member); found != streams_.end()) {
          function.streams.push_back(std::move(found->second));
          streams_.erase(found);
        }
      }
      functions.push_back(std::move(function));
    }
    return functions;
  }

  std::map<std::uint8_t, VideoFunction> controls_;
  std::map<std::uint8_t, StreamInterface> streams_;
  std::map<std::uint8_t, std::vector<std::uint8_t>> members_;  ///< streaming interfaces by control interface
  VideoFunction* control_ = nullptr;                           ///< the interface being walked, if it is one
  StreamInterface* stream_ = nullptr;
  StreamFormat* format_ = nullptr;
  std::uint8_t alternate_ = 0;
};

}  // namespace

const ProcessingUnit* UnitWithGain(const VideoFunction& function, const CameraTerminal& terminal) {
  const ProcessingUnit* found = nullptr;
  for (const ProcessingUnit& unit : function.units) {
    if (!unit.Has(kGain.bit)) continue;
    if (unit.source == terminal.id) return &unit;
    if (found == nullptr) found = &unit;
  }
  return found;
}

Result<std::vector<VideoFunction>> ParseConfiguration(std::span<const std::uint8_t> bytes) {
  return Walk().Run(bytes);
}

}  // namespace lensd::drivers::uvc
