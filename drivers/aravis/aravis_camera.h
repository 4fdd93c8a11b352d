// The camera's part of a GenICam device.
#pragma once

#include <memory>
#include <mutex>
#include <optional>

#include "control_link.h"
#include "device_clock.h"
#include "drivers/api/camera.h"
#include "drivers/api/device.h"
#include "pixel_format.h"
#include "stream.h"

namespace lensd::drivers::aravis {

/// What setting up a camera found out.
struct CameraFacts {
  std::string model;
  std::string serial;
  int width = 0;
  int height = 0;
  const PixelFormat* format = nullptr;
  double frame_rate_hz = 0.0;  ///< 0: not known, or triggered
  double pixel_um = 0.0;       ///< 0: not known
  bool can_set_exposure = false;
  Duration exposure{};
  Duration shortest_exposure{};  ///< 0: not known
  Duration longest_exposure{};   ///< 0: not known
  std::optional<GainRange> gain;
  Findings findings;  ///< exposure or gain that are listed and cannot be used
};

/// What a camera says it is.
struct CameraIdentity {
  std::string model;
  std::string serial;
};
CameraIdentity IdentityOf(ArvCamera* camera);

/// Brings the camera into the state `config` wants and says what it is then; on the link's thread. What cannot be used
/// and is not configured is left out.
Result<CameraFacts> SetUpCamera(ArvCamera* camera, const CameraConfig& config);

/// Frames come over a thread of Aravis', registers over the link's. After a loss it streams again by itself where it
/// did before.
class AravisCamera final : public Camera {
 public:
  AravisCamera(std::shared_ptr<AravisLink> link, const DriverConfig& config, const CameraFacts& facts,
               const Clock& clock);
  ~AravisCamera() override;

 private:
  /// What both the link's thread and the caller's touch.
  struct Shared {
    std::mutex mutex;                ///< never held during I/O
    std::shared_ptr<Stream> stream;  ///< set by the link's thread; nullptr: not streaming now
    bool wanted = false;             ///< between Start() and Stop()
    DeviceClock clock{StampMeaning::ExposureStart};
    std::optional<Duration> exposure_set;  ///< by SetExposure()
    std::optional<double> gain_set;        ///< by SetGain()
    Duration exposure{};
    Duration exposure_before{};
    Instant exposure_changed{};
  };

  Result<void> DoStart() override;
  Result<void> DoStop() override;
  Result<std::optional<Frame>> DoPoll() override;
  Result<void> DoSetExposure(Duration exposure) override;
  Result<void> DoSetGain(double gain) override;
  Result<ExposureState> DoReadExposure() override;
  void DoInterrupt() override { link_->Interrupt(); }
  Counters DoCount() const override;

  static Result<void> Begin(ArvCamera* camera, const CameraConfig& config, Shared& shared,
                            const std::shared_ptr<Mailbox>& mailbox);
  static Result<void> End(ArvCamera* camera, Shared& shared);
  void SetHooks();
  void Trigger();
  Result<Frame> Develop(const RawFrame& raw);

  const std::shared_ptr<AravisLink> link_;
  const DriverConfig config_;
  const PixelFormat& format_;
  const Clock& clock_;
  const std::shared_ptr<Mailbox> mailbox_;
  const std::shared_ptr<Shared> shared_ = std::make_shared<Shared>();
  std::optional<std::uint64_t> last_stamp_;
  std::optional<Instant> triggered_at_;
  Instant last_start_{};
};

}  // namespace lensd::drivers::aravis
