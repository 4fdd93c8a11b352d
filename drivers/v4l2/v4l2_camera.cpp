// Memory-mapped streaming from a capture node: negotiation, buffers, time stamps, exposure. Buffers that the driver
// marks as damaged are dropped.
#include "v4l2_camera.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <utility>

#include "drivers/api/thread_barrier.h"
#include "formats.h"

namespace lensd::drivers::v4l2 {
namespace {

/// Assumed where the driver tells no rate.
constexpr Duration kUnknownPeriod = std::chrono::milliseconds(100);
/// Of the usual transfer functions of video, near enough.
constexpr double kVideoGamma = 2.2;

std::string TextOf(const __u8* text, std::size_t size) {
  const auto* begin = reinterpret_cast<const char*>(text);
  return {begin, strnlen(begin, size)};
}

/// A buffer and, where the node wants them, its planes.
struct Buffer {
  v4l2_buffer buffer{};
  std::array<v4l2_plane, VIDEO_MAX_PLANES> planes{};

  Buffer(std::uint32_t type, bool multi) {
    buffer.type = type;
    buffer.memory = V4L2_MEMORY_MMAP;
    if (multi) {
      buffer.m.planes = planes.data();
      buffer.length = VIDEO_MAX_PLANES;
    }
  }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;
};

std::vector<std::uint32_t> OfferedFormats(const Node& node, std::uint32_t type) {
  std::vector<std::uint32_t> offered;
  for (std::uint32_t i = 0; i < 256; ++i) {
    v4l2_fmtdesc one{};
    one.index = i;
    one.type = type;
    if (node.Ioctl(VIDIOC_ENUM_FMT, &one) < 0) break;
    offered.push_back(one.pixelformat);
  }
  return offered;
}

std::uint32_t TransferOf(const v4l2_format& format, bool planes) {
  const std::uint32_t colours = planes ? format.fmt.pix_mp.colorspace : format.fmt.pix.colorspace;
  const std::uint32_t transfer = planes ? format.fmt.pix_mp.xfer_func : format.fmt.pix.xfer_func;
  if (transfer != V4L2_XFER_FUNC_DEFAULT) return transfer;
  return V4L2_MAP_XFER_FUNC_DEFAULT(colours);
}

/// Whether black and white are 16 and 235 of 8 bits. USB cameras do not say. Taking full range for limited would clip
/// the brightest eighth; the other way round costs nothing but a little contrast.
bool HasVideoRange(const v4l2_format& format, const NodeInfo& info, VideoRange wanted,
                   const drivers::pixels::RawFormat& raw) {
  if (wanted == VideoRange::Full) return false;
  if (wanted == VideoRange::Limited) return raw.limited || !IsLinear(raw);
  const std::uint32_t told = info.planes ? format.fmt.pix_mp.quantization : format.fmt.pix.quantization;
  const bool full =
      told == V4L2_QUANTIZATION_FULL_RANGE || (told == V4L2_QUANTIZATION_DEFAULT && info.driver == "uvcvideo");
  return raw.limited && !full;
}

}  // namespace

struct StreamCamera::Format {
  std::uint32_t code = 0;
  drivers::pixels::RawFormat raw;
  int width = 0;
  int height = 0;
  std::size_t stride = 0;
  std::size_t bytes = 0;  ///< of a picture with its padding, as the driver says
  double gamma = 1.0;
  std::optional<Duration> latency;
  int buffers = 4;
};

Result<NodeInfo> AskNode(const Node& node) {
  v4l2_capability about{};
  const int status = node.Ioctl(VIDIOC_QUERYCAP, &about);
  if (status == -ENOTTY || status == -EINVAL) return Fail(Code::Unsupported, node.path() + " is no video node");
  if (status < 0) return KernelError(-status, node.path());
  const std::uint32_t can = (about.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? about.device_caps : about.capabilities;
  const bool streams = (can & V4L2_CAP_STREAMING) != 0;
  NodeInfo info;
  info.driver = TextOf(about.driver, sizeof about.driver);
  info.card = TextOf(about.card, sizeof about.card);
  info.planes = (can & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0;
  info.capture = streams && (info.planes || (can & V4L2_CAP_VIDEO_CAPTURE) != 0);
  return info;
}

Result<StreamCamera::Format> StreamCamera::Negotiate(const Node& node, const NodeInfo& info, const Config& config) {
  v4l2_format now{};
  now.type = info.planes ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
  int status = node.Ioctl(VIDIOC_G_FMT, &now);
  if (status < 0) return KernelError(-status, node.path() + ", reading its picture format");
  const auto offered = OfferedFormats(node, now.type);
  // pix and pix_mp begin alike: width, height, pixelformat, field.
  v4l2_pix_format& pix = now.fmt.pix;
  std::uint32_t wanted = pix.pixelformat;
  if (!config.format.empty()) {
    wanted = FormatNamed(config.format);
  } else if (!RawFormatOf(wanted)) {
    wanted = BestOf(offered).value_or(0);
  }
  const auto raw = RawFormatOf(wanted);
  if (!raw) {
    const std::string which =
        config.format.empty() ? "no picture format of this device" : "\"" + config.format + "\" is not one that";
    return Fail(Code::Unsupported, node.path() + ": " + which + " can be read" + WhatFits(offered));
  }
  const bool resize = config.width > 0;
  if (wanted != pix.pixelformat || resize) {
    pix.pixelformat = wanted;
    if (resize) pix.width = static_cast<__u32>(config.width);
    if (resize) pix.height = static_cast<__u32>(config.height);
    pix.field = V4L2_FIELD_ANY;
    status = node.Ioctl(VIDIOC_S_FMT, &now);
    if (status == -EBUSY) return Fail(Code::Busy, node.path() + ": another program streams from it");
    if (status < 0) return KernelError(-status, node.path() + ", setting its picture format");
  }
  if (pix.pixelformat != wanted) {
    return Fail(Code::Unsupported,
                node.path() + " has no format \"" + NameOfFormat(wanted) + "\" that can be read" + WhatFits(offered));
  }
  constexpr std::uint32_t kMostSide = 1 << 16;
  if (pix.width < 1 || pix.height < 1 || pix.width > kMostSide || pix.height > kMostSide) {
    return Fail(Code::Protocol, node.path() + ": its driver says that its picture has " + std::to_string(pix.width) +
                                    " x " + std::to_string(pix.height) + " pixels");
  }
  Format format;
  format.code = wanted;
  format.raw = *raw;
  format.width = static_cast<int>(pix.width);
  format.height = static_cast<int>(pix.height);
  if (resize && (format.width != config.width || format.height != config.height)) {
    return Fail(Code::Unsupported, node.path() + " has no picture of " + std::to_string(config.width) + " x " +
                                       std::to_string(config.height) + "; the nearest is " +
                                       std::to_string(format.width) + " x " + std::to_string(format.height));
  }
  format.stride = info.planes ? now.fmt.pix_mp.plane_fmt[0].bytesperline : now.fmt.pix.bytesperline;
  format.bytes = info.planes ? now.fmt.pix_mp.plane_fmt[0].sizeimage : pix.sizeimage;
  format.raw.limited = HasVideoRange(now, info, config.range, *raw);
  const bool linear = IsLinear(*raw) || TransferOf(now, info.planes) == V4L2_XFER_FUNC_NONE;
  format.gamma = config.gamma.value_or(linear ? 1.0 : kVideoGamma);
  format.latency = config.latency;
  format.buffers = config.buffers;
  return format;
}

Result<double> StreamCamera::SetRate(const Node& node, const NodeInfo& info, double wanted_hz) {
  v4l2_streamparm parameters{};
  parameters.type = info.planes ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
  v4l2_fract& period = parameters.parm.capture.timeperframe;
  if (node.Ioctl(VIDIOC_G_PARM, &parameters) < 0) {
    if (wanted_hz > 0.0)
      return Fail(Code::Unsupported, node.path() + ": its frame rate cannot be set; remove frame_rate_hz");
    return 0.0;
  }
  if (wanted_hz > 0.0) {
    period.numerator = 1000;
    period.denominator = static_cast<__u32>(std::lround(std::min(wanted_hz, 4e6) * 1000.0));
    const int status = node.Ioctl(VIDIOC_S_PARM, &parameters);
    if (status < 0) return KernelError(-status, node.path() + ", setting its frame rate");
  }
  // Outside these it is no rate of any camera: not known.
  constexpr double kLowestHz = 1e-3, kHighestHz = 1e6;
  const double rate = period.numerator > 0 ? static_cast<double>(period.denominator) / period.numerator : 0.0;
  return rate >= kLowestHz && rate <= kHighestHz ? rate : 0.0;
}

Result<std::unique_ptr<drivers::Camera>> StreamCamera::Make(std::shared_ptr<const Node> node,
                                                            std::shared_ptr<Automatics> automatics,
                                                            const NodeInfo& info, const std::string& serial,
                                                            const Config& config, drivers::Findings& findings,
                                                            const Clock& clock) {
  const auto format = Negotiate(*node, info, config);
  if (!format) return PassOn(format);
  const auto rate = SetRate(*node, info, config.frame_rate_hz);
  if (!rate) return PassOn(rate);
  auto image = ImageControls::Find(node, std::move(automatics), findings);
  if (!image) return PassOn(image);
  drivers::CameraCapabilities can;
  can.driver = "v4l2";
  can.model = info.card + " (" + info.driver + ")";
  can.serial = serial;
  can.width = format->width;
  can.height = format->height;
  can.bits = format->raw.bits;
  can.colour = drivers::pixels::HasColour(format->raw);
  can.pixel_um = config.pixel_um;
  can.frame_rate_hz = *rate;
  image->Describe(can);
  return std::unique_ptr<drivers::Camera>(
      new StreamCamera(std::move(can), std::move(node), info, *format, *std::move(image), clock));
}

StreamCamera::StreamCamera(drivers::CameraCapabilities can, std::shared_ptr<const Node> node, const NodeInfo& info,
                           const Format& format, ImageControls image, const Clock& clock)
    : Camera(std::move(can)),
      node_(std::move(node)),
      info_(info),
      format_(std::make_unique<const Format>(format)),
      image_(std::move(image)),
      clock_(clock),
      counter_(capabilities().frame_rate_hz) {}

StreamCamera::~StreamCamera() {
  Contain([this] { (void)DoStop(); });
}

std::uint32_t StreamCamera::type() const {
  return info_.planes ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
}

Result<void> StreamCamera::DoStart() {
  if (!buffers_.empty()) return {};
  auto mapped = MapBuffers();
  for (std::uint32_t i = 0; mapped && i < buffers_.size(); ++i) mapped = Queue(i);
  if (mapped) {
    std::uint32_t stream = type();
    const int status = node_->Ioctl(VIDIOC_STREAMON, &stream);
    if (status < 0) mapped = KernelError(-status, node_->path() + ", starting the stream");
  }
  if (!mapped) UnmapBuffers();
  NoteUsable();
  return mapped;
}

Result<void> StreamCamera::DoStop() {
  if (buffers_.empty()) return {};
  std::uint32_t stream = type();
  const int status = node_->Ioctl(VIDIOC_STREAMOFF, &stream);
  UnmapBuffers();
  if (status < 0) return KernelError(-status, node_->path() + ", ending the stream");
  return {};
}

Result<void> StreamCamera::MapBuffers() {
  v4l2_requestbuffers request{};
  request.count = static_cast<__u32>(format_->buffers);
  request.type = type();
  request.memory = V4L2_MEMORY_MMAP;
  const int status = node_->Ioctl(VIDIOC_REQBUFS, &request);
  if (status == -EBUSY) return Fail(Code::Busy, node_->path() + ": another program streams from it");
  if (status < 0) return KernelError(-status, node_->path() + ", asking for buffers");
  for (std::uint32_t i = 0; i < request.count; ++i) {
    Buffer one(type(), info_.planes);
    one.buffer.index = i;
    const int asked = node_->Ioctl(VIDIOC_QUERYBUF, &one.buffer);
    if (asked < 0) return KernelError(-asked, node_->path() + ", asking for a buffer");
    Mapping mapping;
    mapping.length = info_.planes ? one.planes[0].length : one.buffer.length;
    const std::int64_t offset = info_.planes ? one.planes[0].m.mem_offset : one.buffer.m.offset;
    mapping.memory = node_->kernel().Map(node_->fd(), mapping.length, offset);
    if (mapping.memory == nullptr) return Fail(Code::Io, node_->path() + ": its buffers cannot be mapped into memory");
    buffers_.push_back(mapping);
  }
  if (buffers_.empty()) return Fail(Code::Io, node_->path() + " gave no buffers");
  return {};
}

void StreamCamera::UnmapBuffers() {
  for (const Mapping& mapping : buffers_) node_->kernel().Unmap(mapping.memory, mapping.length);
  buffers_.clear();
  // None: gives the memory back, so that the format may change and others may stream.
  v4l2_requestbuffers request{};
  request.type = type();
  request.memory = V4L2_MEMORY_MMAP;
  (void)node_->Ioctl(VIDIOC_REQBUFS, &request);
}

Result<void> StreamCamera::Queue(std::uint32_t index) const {
  Buffer one(type(), info_.planes);
  one.buffer.index = index;
  const int status = node_->Ioctl(VIDIOC_QBUF, &one.buffer);
  if (status < 0) return KernelError(-status, node_->path() + ", giving a buffer back");
  return {};
}

Result<std::optional<StreamCamera::Filled>> StreamCamera::Dequeue() const {
  Buffer one(type(), info_.planes);
  const int status = node_->Ioctl(VIDIOC_DQBUF, &one.buffer);
  if (status == -EAGAIN) return std::nullopt;
  if (status < 0) {
    // A device that is pulled out fails its stream first, with an error of any kind.
    if (const auto still = AskNode(*node_); !still) return PassOn(still);
    return KernelError(-status, node_->path() + ", waiting for a frame");
  }
  if (one.buffer.index >= buffers_.size())
    return Fail(Code::Protocol, node_->path() + " filled a buffer it was not given");
  Filled filled;
  filled.index = one.buffer.index;
  filled.bytes = std::min<std::size_t>(info_.planes ? one.planes[0].bytesused : one.buffer.bytesused,
                                       buffers_[one.buffer.index].length);
  filled.sequence = one.buffer.sequence;
  filled.damaged = (one.buffer.flags & V4L2_BUF_FLAG_ERROR) != 0;
  filled.at_start = (one.buffer.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  constexpr std::int64_t kCentury = 3'155'760'000;  // s: no machine runs for so long
  const bool possible = one.buffer.timestamp.tv_sec >= 0 && one.buffer.timestamp.tv_sec < kCentury &&
                        one.buffer.timestamp.tv_usec >= 0 && one.buffer.timestamp.tv_usec < 1'000'000;
  if (possible && (one.buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC) {
    filled.stamp = Instant(std::chrono::seconds(one.buffer.timestamp.tv_sec) +
                           std::chrono::microseconds(one.buffer.timestamp.tv_usec));
  }
  return filled;
}

Result<std::optional<drivers::Frame>> StreamCamera::DoPoll() {
  if (buffers_.empty()) return Fail(Code::InvalidArgument, "the camera is not streaming: start it first");
  // While the rig did not poll, the kernel had no buffers left, and what it dropped was not wanted.
  const Instant now = clock_.Now();
  if (now - std::exchange(polled_, now) >= (std::ssize(buffers_) - 1) * Period()) counter_.Restart();
  // Each turn gives a buffer back, so a fast camera could keep us: once through them all is enough.
  std::optional<Filled> last;
  for (std::size_t i = 0; i < buffers_.size(); ++i) {
    const auto filled = Dequeue();
    if (!filled) return PassOn(filled);
    if (!*filled) break;
    if (last) {
      Count(*last, now, !last->damaged);
      if (auto queued = Queue(last->index); !queued) return PassOn(queued);
    }
    last = **filled;
  }
  if (!last) return std::nullopt;
  auto picture = Picture(*last);
  if (auto queued = Queue(last->index); !queued) return PassOn(queued);
  Count(*last, now, picture.has_value());
  if (picture && luma_.flawed()) counter_.Flawed();
  // A frame that cannot be used is no error: the next one is on its way.
  picture ? NoteUsable() : NoteUnusable(picture.error().message);
  return picture ? std::optional(*std::move(picture)) : std::nullopt;
}

void StreamCamera::Count(const Filled& filled, Instant now, bool usable) {
  const Instant at = filled.stamp.value_or(now);
  usable ? counter_.Came(filled.sequence, at) : counter_.Damaged(filled.sequence, at);
}

Result<drivers::Frame> StreamCamera::Picture(const Filled& filled) {
  if (filled.damaged) return Fail(Code::Protocol, "damaged: the kernel's driver marks it so");
  const auto* memory = static_cast<const std::uint8_t*>(buffers_[filled.index].memory);
  const drivers::pixels::RawPicture picture{
      {memory, filled.bytes}, format_->width, format_->height, format_->stride, format_->bytes};
  auto samples = luma_.Read(format_->raw, picture);
  if (!samples) return PassOn(samples);
  drivers::Frame frame;
  frame.width = format_->width;
  frame.height = format_->height;
  frame.bits = format_->raw.bits;
  frame.gamma = format_->gamma;
  frame.samples = std::move(*samples);
  frame.colour = drivers::pixels::MakerOfColour(format_->raw, picture);
  frame.sequence = filled.sequence;
  SetTimes(filled, frame);
  return frame;
}

Duration StreamCamera::Period() const {
  const double rate = capabilities().frame_rate_hz;
  return rate > 0.0 ? Duration(std::llround(1e9 / rate)) : kUnknownPeriod;
}

/// The interval is never too short, since the rig that moves the lens relies on it: what a driver leaves open counts as
/// exposed.
void StreamCamera::SetTimes(const Filled& filled, drivers::Frame& frame) const {
  const Duration exposure = image_.exposure().value_or(Period());
  // What is here has been exposed, whatever the driver says.
  const Instant now = clock_.Now();
  const Instant stamp = std::min(filled.stamp.value_or(now), now);
  if (filled.at_start && info_.driver != "uvcvideo") {
    frame.exposure_start = stamp;
    frame.exposure_end = std::min(stamp + exposure, now);
    return;
  }
  // Most stamp the end of the transfer. uvcvideo calls it the start of the exposure and stamps the first packet, which
  // leaves once the first line has been exposed; the last line follows within a period.
  frame.exposure_start = stamp - exposure - format_->latency.value_or(Period());
  frame.exposure_end = filled.at_start ? std::min(stamp + Period(), now) : stamp;
}

}  // namespace lensd::drivers::v4l2
