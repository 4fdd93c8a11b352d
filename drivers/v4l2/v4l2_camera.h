// A V4L2 capture node as a camera: memory-mapped streaming.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config.h"
#include "controls.h"
#include "drivers/api/camera.h"
#include "drivers/pixels/colour.h"
#include "drivers/pixels/luma.h"
#include "image_controls.h"
#include "kernel.h"

namespace lensd::drivers::v4l2 {

/// What a node says it is.
struct NodeInfo {
  std::string driver;  ///< "uvcvideo"
  std::string card;    ///< "vivid"
  bool capture = false;
  bool planes = false;  ///< by the multi-planar calls
};
/// Unsupported: no V4L2 video node (a sub-device).
Result<NodeInfo> AskNode(const Node& node);

/// Poll() takes what the kernel has filled, hands out the newest and gives the rest back; there is no thread.
class StreamCamera final : public drivers::Camera {
 public:
  /// Sets format, size and rate as configured; exposure and gain that cannot be used are left out. Unsupported: no
  /// picture format that is known, or not the one asked for.
  static Result<std::unique_ptr<drivers::Camera>> Make(std::shared_ptr<const Node> node,
                                                       std::shared_ptr<Automatics> automatics, const NodeInfo& info,
                                                       const std::string& serial, const Config& config,
                                                       drivers::Findings& findings, const Clock& clock);
  ~StreamCamera() override;

 private:
  struct Format;
  struct Mapping {
    void* memory = nullptr;
    std::size_t length = 0;
  };
  /// One filled buffer.
  struct Filled {
    std::uint32_t index = 0;
    std::size_t bytes = 0;
    std::uint64_t sequence = 0;
    std::optional<Instant> stamp;  ///< none: the driver's clock is not CLOCK_MONOTONIC
    bool at_start = false;         ///< the stamp is of the exposure's start
    bool damaged = false;
  };

  StreamCamera(drivers::CameraCapabilities can, std::shared_ptr<const Node> node, const NodeInfo& info,
               const Format& format, ImageControls image, const Clock& clock);
  Result<void> DoStart() override;
  Result<void> DoStop() override;
  Result<std::optional<drivers::Frame>> DoPoll() override;
  Result<void> DoSetExposure(Duration exposure) override { return image_.SetExposure(exposure); }
  Result<void> DoSetGain(double gain) override { return image_.SetGain(gain); }
  Result<drivers::ExposureState> DoReadExposure() override { return image_.Read(); }
  drivers::Counters DoCount() const override {
    drivers::Counters counts = counter_.counts();
    counts.bus_errors = failed_calls();
    return counts;
  }

  static Result<Format> Negotiate(const Node& node, const NodeInfo& info, const Config& config);
  static Result<double> SetRate(const Node& node, const NodeInfo& info, double wanted_hz);
  Result<void> MapBuffers();
  void UnmapBuffers();
  Result<void> Queue(std::uint32_t index) const;
  /// The next filled buffer; none: not yet.
  Result<std::optional<Filled>> Dequeue() const;
  /// Protocol: it cannot be used; why.
  Result<drivers::Frame> Picture(const Filled& filled);
  void Count(const Filled& filled, Instant now, bool usable);
  void SetTimes(const Filled& filled, drivers::Frame& frame) const;
  /// From frame to frame, and so the longest an exposure may last.
  Duration Period() const;
  std::uint32_t type() const;

  const std::shared_ptr<const Node> node_;
  const NodeInfo info_;
  const std::unique_ptr<const Format> format_;
  ImageControls image_;
  const Clock& clock_;
  drivers::FrameCounter counter_;
  Instant polled_{};  ///< last
  drivers::pixels::LumaReader luma_;
  std::vector<Mapping> buffers_;  ///< of the plane that has the luminance; empty: not streaming
};

}  // namespace lensd::drivers::v4l2
