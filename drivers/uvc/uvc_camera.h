// The pictures of a USB camera.
#pragma once

#include <memory>
#include <optional>

#include "axis_control.h"
#include "config.h"
#include "drivers/api/camera.h"
#include "drivers/api/device.h"
#include "drivers/pixels/colour.h"
#include "drivers/pixels/luma.h"
#include "frame_assembler.h"
#include "session.h"
#include "stream_choice.h"

namespace lensd::drivers::uvc {

/// The class tells nothing about when a frame was exposed that could be trusted: the interval is the widest that fits,
/// from one exposure and the latency before a picture's first byte to its last byte.
class UvcCamera final : public Camera {
 public:
  /// Exposure and gain that are listed and cannot be used are left out. Unsupported: no picture that fits the
  /// configuration. Errors of the whole device.
  static Result<std::unique_ptr<Camera>> Open(std::shared_ptr<Session> session, const CameraConfig& config,
                                              Findings& findings);
  ~UvcCamera() override;

 private:
  /// What can be set; nothing: it cannot.
  struct Ranges {
    std::optional<ControlRange> exposure;  ///< 100 us
    std::optional<ControlRange> gain;      ///< the camera's own count
    ControlAddress gain_at{};
  };

  UvcCamera(CameraCapabilities capabilities, std::shared_ptr<Session> session, const CameraConfig& config,
            const StreamChoice& choice, const Ranges& ranges);

  Result<void> DoStart() override;
  Result<void> DoStop() override;
  Result<std::optional<Frame>> DoPoll() override;
  Result<void> DoSetExposure(Duration exposure) override;
  Result<void> DoSetGain(double gain) override;
  Result<ExposureState> DoReadExposure() override;
  Counters DoCount() const override;
  void NoteIncomplete();
  void DoInterrupt() override { session_->transport().Interrupt(); }

  static Result<Ranges> AskRanges(Session& session, Findings& findings);
  static void Describe(const Ranges& ranges, CameraCapabilities& can);
  /// As the camera has it; one frame period where it does not say.
  Result<Duration> AskExposure();

  const std::shared_ptr<Session> session_;
  const CameraConfig config_;
  const StreamChoice choice_;
  const Duration period_;
  const Ranges ranges_;
  FrameAssembler assembler_;
  pixels::LumaReader luma_;
  bool streaming_ = false;
  Duration exposure_{};
  Instant last_sign_{};  ///< of life: the start or a frame
};

}  // namespace lensd::drivers::uvc
