// The pictures of a USB camera.
#pragma once

#include <memory>
#include <optional>

#include "config.h"
#include "drivers/api/camera.h"
#include "drivers/pixels/luma.h"
#include "frame_assembler.h"
#include "session.h"
#include "stream_choice.h"

namespace lensd::drivers::uvc {

/// The class tells nothing about when a frame was exposed that could be trusted: the interval is the widest that fits,
/// from one exposure and the latency before a picture's first byte to its last byte.
class UvcCamera final : public Camera {
 public:
  /// Unsupported: no picture that fits the configuration. Errors of the device.
  static Result<std::unique_ptr<Camera>> Open(std::shared_ptr<Session> session, const CameraConfig& config);
  ~UvcCamera() override;

 private:
  UvcCamera(CameraCapabilities capabilities, std::shared_ptr<Session> session, const CameraConfig& config,
            const StreamChoice& choice, bool exposure);

  Result<void> DoStart() override;
  Result<void> DoStop() override;
  Result<std::optional<Frame>> DoPoll() override;
  Result<void> DoSetExposure(Duration exposure) override;
  Result<ExposureState> DoReadExposure() override;
  Counters DoCount() const override;
  void DoInterrupt() override { session_->transport().Interrupt(); }

  /// As the camera has it; one frame period where it does not say.
  Result<Duration> AskExposure();

  const std::shared_ptr<Session> session_;
  const CameraConfig config_;
  const StreamChoice choice_;
  const Duration period_;
  const bool exposure_control_;
  FrameAssembler assembler_;
  pixels::LumaReader luma_;
  bool streaming_ = false;
  Duration exposure_{};
  Instant last_sign_{};  ///< of life: the start or a frame
};

}  // namespace lensd::drivers::uvc
