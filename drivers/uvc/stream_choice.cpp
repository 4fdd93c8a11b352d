// Which format, size and rate to ask a camera for, and the probe-commit negotiation, which may end in something else
// than was asked.
#include "stream_choice.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>
#include <utility>
#include <vector>

namespace lensd::drivers::uvc {
namespace {

constexpr double kFastEnough_hz = 15.0;
constexpr std::uint32_t kMostBulkBytes = 1u << 20;
constexpr std::uint32_t kTicks = 10'000'000;  // of 100 ns, a second

/// bytes of the probe structure by version of the class
std::uint16_t ProbeLength(std::uint16_t version) {
  if (version < 0x0110) return 26;
  return version < 0x0150 ? 34 : 48;
}

double FastestHz(const StreamFrame& frame) {
  std::uint32_t shortest = frame.default_interval;
  for (const std::uint32_t interval : frame.intervals) {
    if (interval > 0) shortest = std::min(shortest, interval);
  }
  return shortest > 0 ? static_cast<double>(kTicks) / shortest : 0.0;
}

std::uint32_t NearestInterval(const StreamFrame& frame, std::optional<double> rate_hz) {
  if (!rate_hz || frame.intervals.empty()) return frame.default_interval;
  const double wanted = kTicks / *rate_hz;
  if (frame.continuous) {
    return static_cast<std::uint32_t>(std::lround(
        std::clamp<double>(wanted, frame.intervals.front(), std::max(frame.intervals[0], frame.intervals[1]))));
  }
  return *std::ranges::min_element(frame.intervals, {}, [&](std::uint32_t one) { return std::abs(one - wanted); });
}

const StreamFrame* FindFrame(const StreamFormat& format, int width, int height) {
  const auto found = std::ranges::find_if(
      format.frames, [&](const StreamFrame& frame) { return frame.width == width && frame.height == height; });
  return found == format.frames.end() ? nullptr : &*found;
}

const StreamFrame* DefaultFrame(const StreamFormat& format) {
  const auto found = std::ranges::find(format.frames, format.default_frame, &StreamFrame::index);
  if (found != format.frames.end()) return &*found;
  return format.frames.empty() ? nullptr : &format.frames.front();
}

std::string Offers(const VideoFunction& function) {
  std::ostringstream text;
  for (const StreamInterface& stream : function.streams) {
    for (const StreamFormat& format : stream.formats) {
      text << (text.tellp() > 0 ? "; " : "") << InfoOf(format.pixels).name;
      for (const StreamFrame& frame : format.frames) text << " " << frame.width << "x" << frame.height;
    }
  }
  return text.str();
}

struct Candidate {
  const StreamFormat* format;
  const StreamFrame* frame;
};

/// One per format that fits, the best first.
std::vector<Candidate> Candidates(const StreamInterface& stream, const CameraConfig& config) {
  std::vector<Candidate> found;
  int width = config.width.value_or(0), height = config.height.value_or(0);
  for (const PixelFormatInfo& known : PixelFormats()) {
    if (config.format && *config.format != known.format) continue;
    for (const StreamFormat& format : stream.formats) {
      if (format.pixels != known.format) continue;
      const StreamFrame* frame = width > 0 ? FindFrame(format, width, height) : DefaultFrame(format);
      if (frame == nullptr) continue;
      width = frame->width;
      height = frame->height;
      found.push_back({&format, frame});
    }
  }
  return found;
}

}  // namespace

Result<StreamChoice> Choose(const VideoFunction& function, const CameraConfig& config) {
  if (function.streams.empty()) return Fail(Code::Unsupported, "this camera has no streaming interface");
  // Some cameras have several streams of the same scene: the first that has what is wanted is taken.
  std::vector<Candidate> candidates;
  auto stream = function.streams.begin();
  for (; stream != function.streams.end() && candidates.empty(); ++stream) candidates = Candidates(*stream, config);
  if (candidates.empty() && Offers(function).empty()) {
    return Fail(Code::Unsupported, "no picture format of this camera can be read");
  }
  if (candidates.empty()) {
    return Fail(Code::Unsupported, "the camera does not offer the picture asked for; it has " + Offers(function));
  }
  --stream;
  const double wanted_hz = config.frame_rate_hz.value_or(kFastEnough_hz);
  const auto fast =
      std::ranges::find_if(candidates, [&](const Candidate& one) { return FastestHz(*one.frame) >= 0.99 * wanted_hz; });
  const Candidate& best = fast != candidates.end() ? *fast : candidates.back();
  StreamChoice choice;
  choice.interface = stream->number;
  choice.format_index = best.format->index;
  choice.frame_index = best.frame->index;
  choice.pixels = best.format->pixels;
  choice.transfer_characteristics = best.format->transfer_characteristics;
  choice.width = best.frame->width;
  choice.height = best.frame->height;
  choice.interval = NearestInterval(*best.frame, config.frame_rate_hz);
  if (choice.interval == 0) choice.interval = kTicks / 30;
  return choice;
}

namespace {

Result<StreamPipe> PipeFor(const StreamInterface& stream, std::uint32_t payload_bytes) {
  const StreamSetting* best = nullptr;
  for (const StreamSetting& setting : stream.settings) {
    if (!setting.isochronous && setting.alternate == 0) {
      if (payload_bytes > kMostBulkBytes) break;
      // Whole packets: the end of a payload that fills its transfer needs no short packet then.
      const std::uint32_t packet = std::max(1u, setting.packet_bytes);
      return StreamPipe{stream.number, 0, setting.endpoint, false, (payload_bytes + packet - 1) / packet * packet};
    }
    if (!setting.isochronous || setting.packet_bytes < payload_bytes) continue;
    if (best == nullptr || setting.packet_bytes < best->packet_bytes) best = &setting;
  }
  if (best == nullptr) {
    return Fail(Code::Unsupported, "the camera wants payloads of " + std::to_string(payload_bytes) +
                                       " bytes, for which none of its settings is wide enough");
  }
  return StreamPipe{stream.number, best->alternate, best->endpoint, true, best->packet_bytes};
}

}  // namespace

Result<StreamPipe> Negotiate(Session& session, const StreamChoice& choice) {
  const std::string what = "stream";
  const std::uint16_t length = ProbeLength(session.function.version);
  const ControlAddress probe{kVsProbe, 0, choice.interface};
  std::vector<std::uint8_t> ask(length);
  ask[0] = 1;  // bmHint: the frame interval is what matters
  ask[2] = choice.format_index;
  ask[3] = choice.frame_index;
  std::ranges::copy(ToLittle(choice.interval, 4), ask.begin() + 4);
  if (auto set = session.controls.Set(probe, ask, what); !set) return PassOn(set);
  auto agreed = session.controls.Get(kGetCur, probe, length, what);
  if (!agreed) return PassOn(agreed);
  if ((*agreed)[2] != choice.format_index || (*agreed)[3] != choice.frame_index) {
    return Fail(Code::Unsupported,
                "the camera does not agree to the picture it offers: ask for another size or format");
  }
  const std::uint32_t payload_bytes = FromLittle(std::span(*agreed).subspan(22, 4));
  if (payload_bytes == 0) return Fail(Code::Protocol, "the camera agrees to payloads of no bytes at all");
  const auto stream = std::ranges::find(session.function.streams, choice.interface, &StreamInterface::number);
  auto pipe = PipeFor(*stream, payload_bytes);
  if (!pipe) return pipe;
  if (auto set = session.controls.Set({kVsCommit, 0, choice.interface}, *agreed, what); !set) {
    return PassOn(set);
  }
  return pipe;
}

}  // namespace lensd::drivers::uvc
