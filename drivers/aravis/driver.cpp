// Opens one GenICam device as a lens, a camera or both on a shared control channel. What was found at first opening
// must be there again when the camera comes back.
#include "drivers/aravis/driver.h"

#include <arv.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "aravis_camera.h"
#include "aravis_lens.h"
#include "config.h"

namespace lensd::drivers::aravis {
namespace {

/// What was found out when the camera was first opened, and must not change when it comes back.
struct Found {
  bool opened = false;
  CameraIdentity identity{};
  std::optional<CameraFacts> camera{};  ///< nothing: its pictures were left out
  LensFacts lens{};
  Findings findings{};
};

bool SameAxis(const std::optional<AxisFeature>& before, const std::optional<AxisFeature>& now) {
  if (!before || !now) return before.has_value() == now.has_value();
  return before->feature == now->feature && before->status == now->status && before->can.minimum == now->can.minimum &&
         before->can.maximum == now->can.maximum && before->can.resolution == now->can.resolution;
}

/// WrongDevice: the camera is back without the lens that it had.
Result<void> ExpectLens(ArvCamera* camera, const DriverConfig& config, const LensFacts& before) {
  const auto now = FindLens(camera, config.lens);
  if (!now && now.error().code != Code::Unsupported) return PassOn(now);
  const bool same =
      now && now->status == before.status && now->abort == before.abort && std::ranges::all_of(kAxes, [&](Axis axis) {
        const bool not_missed = !before.axes[axis] && before.findings.Of(AxisName(axis)) != nullptr;
        return not_missed || SameAxis(before.axes[axis], now->axes[axis]);
      });
  if (same) return {};
  const std::string what = !now         ? now.error().message
                           : now->any() ? "its lens has other features or ranges than before"
                                        : "it has no lens any more";
  return Fail(Code::WrongDevice, "the camera with " + config.Named() + " is back, but " + what);
}

/// The pictures are of no use, and so are the features for nothing but them, where the camera has any.
void LeavePicturesOut(ArvCamera* camera, const Error& why, Findings& findings) {
  findings.LeaveOut("camera", why);
  const Error with_them{why.code, "it describes the pictures, which are left out"};
  CallError exposure_error, gain_error;
  const bool exposure = arv_camera_is_exposure_time_available(camera, exposure_error.out()) != 0;
  const bool gain = arv_camera_is_gain_available(camera, gain_error.out()) != 0;
  if (exposure && !exposure_error) findings.LeaveOut("exposure", with_them);
  if (gain && !gain_error) findings.LeaveOut("gain", with_them);
}

Result<void> SetUpFirst(ArvCamera* camera, const DriverConfig& config, Found& found) {
  auto facts = SetUpCamera(camera, config.camera);
  if (!facts && (CameraIsGone(facts.error()) || config.camera.names_pictures())) return PassOn(facts);
  auto lens = FindLens(camera, config.lens);
  if (!lens) return PassOn(lens);
  found.identity = IdentityOf(camera);
  found.findings.Add(lens->findings);
  if (facts) found.findings.Add(facts->findings);
  if (!facts) LeavePicturesOut(camera, facts.error(), found.findings);
  if (!facts && !lens->any()) return PassOn(found.findings.NothingLeft("the camera with " + config.Named()));
  if (facts) found.camera = *std::move(facts);
  found.lens = *std::move(lens);
  found.opened = true;
  return {};
}

Result<void> SetUp(ArvCamera* camera, const DriverConfig& config, Found& found) {
  if (!found.opened) {
    Found first;
    if (auto done = SetUpFirst(camera, config, first); !done) return done;
    found = std::move(first);
    return {};
  }
  if (const CameraIdentity now = IdentityOf(camera);
      now.serial != found.identity.serial || now.model != found.identity.model) {
    return Fail(Code::WrongDevice, "another camera answers at " + config.Named() + " now: " + now.model +
                                       " with serial number " + now.serial + " instead of " + found.identity.model +
                                       " with " + found.identity.serial);
  }
  if (found.camera) {
    const auto facts = SetUpCamera(camera, config.camera);
    if (!facts) return PassOn(facts);
    const CameraFacts& before = *found.camera;
    if (facts->width != before.width || facts->height != before.height || facts->format != before.format) {
      return Fail(Code::WrongDevice, "the camera came back with another picture size or format");
    }
  }
  return ExpectLens(camera, config, found.lens);
}

}  // namespace

Result<void> CheckAravis(const Settings& settings) {
  const auto config = ReadDriverConfig(settings);
  if (!config) return PassOn(config);
  return {};
}

Result<Device> OpenAravis(const Settings& settings, const Clock& clock) {
  auto config = ReadDriverConfig(settings);
  if (!config) return PassOn(config);
  const auto found = std::make_shared<Found>();
  auto link = AravisLink::Open(*config, [found, config = *config](ArvCamera* camera) -> Result<bool> {
    if (auto done = SetUp(camera, config, *found); !done) return PassOn(done);
    return found->lens.any();
  });
  if (!link) return PassOn(link);
  Device device;
  device.findings = found->findings;
  if (found->camera) device.camera = std::make_unique<AravisCamera>(*link, *config, *found->camera, clock);
  if (found->lens.any()) {
    LensFacts lens = found->lens;
    if (lens.model.empty()) lens.model = "lens of " + found->identity.model;
    device.lens = std::make_unique<AravisLens>(*link, std::move(lens), found->identity.serial, clock);
  }
  return device;
}

}  // namespace lensd::drivers::aravis
