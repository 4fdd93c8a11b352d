// Bringing a camera into the state the configuration wants.
#include <arv.h>

#include <cmath>
#include <string>

#include "aravis_camera.h"
#include "aravis_lens.h"

namespace lensd::drivers::aravis {
namespace {

/// One call of Aravis' with its GError, as a Result.
template <class Function, class... Arguments>
Result<void> Do(const std::string& doing, Function function, Arguments... arguments) {
  CallError error;
  function(arguments..., error.out());
  return error.Check(doing);
}

/// The format wanted, or the one set now, or the first there is that can be read.
Result<const PixelFormat*> SetPixelFormat(ArvCamera* camera, const std::string& wanted) {
  if (!wanted.empty()) {
    auto set = Do("setting pixel_format " + wanted, arv_camera_set_pixel_format_from_string, camera, wanted.c_str());
    if (!set) return PassOn(set);
    return FindPixelFormat(wanted);
  }
  CallError error;
  const ArvPixelFormat now = arv_camera_get_pixel_format(camera, error.out());
  if (error) return error.Why("asking for the pixel format");
  if (const PixelFormat* format = FindPixelFormat(now)) return format;
  CallError list_error;
  guint count = 0;
  const std::unique_ptr<gint64[], void (*)(void*)> codes(
      arv_camera_dup_available_pixel_formats(camera, &count, list_error.out()), g_free);
  if (list_error) return list_error.Why("asking for the pixel formats");
  for (const PixelFormat& format : PixelFormats()) {
    for (guint i = 0; i < count; ++i) {
      if (codes[i] != format.code) continue;
      auto set = Do("setting the pixel format", arv_camera_set_pixel_format, camera, format.code);
      if (!set) return PassOn(set);
      return &format;
    }
  }
  return Fail(Code::Unsupported, "this camera has no pixel format that can be read as luminance");
}

Result<void> SetRegion(ArvCamera* camera, const CameraConfig& config) {
  if (!config.region) return {};
  const auto [x, y, width, height] = *config.region;
  if (auto set = Do("setting region_px", arv_camera_set_region, camera, x, y, width, height); !set) return set;
  gint got[4] = {};
  CallError error;
  arv_camera_get_region(camera, &got[0], &got[1], &got[2], &got[3], error.out());
  if (error) return error.Why("reading the region back");
  if (got[0] == x && got[1] == y && got[2] == width && got[3] == height) return {};
  return Fail(Code::OutOfRange, "the camera took another region_px: [" + std::to_string(got[0]) + ", " +
                                    std::to_string(got[1]) + ", " + std::to_string(got[2]) + ", " +
                                    std::to_string(got[3]) + "]");
}

/// The camera's own control of exposure and gain would change pictures while they are compared. Where it cannot be
/// switched off, neither can what it controls be set.
Result<void> SwitchOff(ArvCamera* camera, const char* automatic, const char* part, bool configured,
                       Findings& findings) {
  if (!Has(camera, automatic)) return {};
  const std::string doing = "switching " + std::string(automatic) + " off";
  auto off = Do(doing, arv_camera_set_string, camera, automatic, "Off");
  if (off || configured || CameraIsGone(off.error())) return off;
  findings.LeaveOut(part, off.error());
  return {};
}

Result<void> SetLight(ArvCamera* camera, const CameraConfig& config, Findings& findings) {
  auto off = SwitchOff(camera, "ExposureAuto", "exposure", config.exposure_ms.has_value(), findings);
  if (off) off = SwitchOff(camera, "GainAuto", "gain", config.gain.has_value(), findings);
  if (!off) return off;
  if (config.gain) {
    if (auto set = Do("setting gain", arv_camera_set_gain, camera, *config.gain); !set) return set;
  }
  if (!config.exposure_ms) return {};
  return Do("setting exposure_ms", arv_camera_set_exposure_time, camera, *config.exposure_ms * 1e3);
}

Result<void> SetPace(ArvCamera* camera, const CameraConfig& config) {
  if (Has(camera, "AcquisitionMode")) {
    auto set = Do("setting AcquisitionMode", arv_camera_set_string, camera, "AcquisitionMode", "Continuous");
    if (!set) return set;
  }
  if (!config.trigger.empty()) {
    return Do("setting trigger " + config.trigger, arv_camera_set_trigger, camera, config.trigger.c_str());
  }
  if (Has(camera, "TriggerMode")) {
    if (auto cleared = Do("switching triggers off", arv_camera_clear_triggers, camera); !cleared) return cleared;
  }
  if (!config.frame_rate_hz) return {};
  return Do("setting frame_rate_hz", arv_camera_set_frame_rate, camera, *config.frame_rate_hz);
}

Result<void> SetTransport(ArvCamera* camera, const CameraConfig& config) {
  if (!arv_camera_is_gv_device(camera)) return {};
  // Raw packet sockets need a privilege that the daemon does not have.
  arv_camera_gv_set_stream_options(camera, ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  // Aravis would otherwise try sizes out when it makes a stream.
  arv_camera_gv_set_packet_size_adjustment(camera, ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
  auto set = Do("setting packet_size", arv_camera_gv_set_packet_size, camera, config.packet_size);
  if (!set || !config.packet_delay_us) return set;
  const auto delay_ns = static_cast<gint64>(std::llround(*config.packet_delay_us * 1e3));
  return Do("setting packet_delay_us", arv_camera_gv_set_packet_delay, camera, delay_ns);
}

double PixelPitch(ArvCamera* camera) {
  for (const char* feature : {"SensorPixelWidth", "SensorPixelHeight"}) {
    if (!Has(camera, feature)) continue;
    CallError error;
    const double pitch = arv_camera_get_float(camera, feature, error.out());
    if (!error && pitch > 0.0 && pitch < 1000.0) return pitch;
  }
  return 0.0;
}

/// Assumed where a camera does not say how long it exposes, and neither how fast.
constexpr Duration kUnknownExposure = std::chrono::milliseconds(100);

Result<void> ReadExposureFacts(ArvCamera* camera, CameraFacts& facts) {
  if (arv_camera_is_exposure_time_available(camera, nullptr) == 0) return {};
  CallError least_error, exposure_error;
  const double exposure_us = arv_camera_get_exposure_time(camera, exposure_error.out());
  const bool frames_say = facts.frame_rate_hz > 0.0;
  facts.exposure = frames_say ? Duration(std::llround(1e9 / facts.frame_rate_hz)) : kUnknownExposure;
  if (exposure_error) {
    const Error why = exposure_error.Why("asking for the exposure time").error();
    if (CameraIsGone(why)) return PassOn(why);
    facts.findings.LeaveOut("exposure", why);
    return {};
  }
  facts.exposure = Duration(std::llround(exposure_us * 1e3));
  // A camera that says nothing of its ranges has none that are known.
  double lowest_us = 0.0, highest_us = 0.0;
  arv_camera_get_exposure_time_bounds(camera, &lowest_us, &highest_us, least_error.out());
  constexpr double kMostUs = 1e12;
  if (!least_error && lowest_us >= highest_us) {
    facts.findings.LeaveOut(
        "exposure", {Code::Unsupported, "the camera says that exposures go from " + std::to_string(lowest_us) + " to " +
                                            std::to_string(highest_us) + " us"});
  }
  if (!least_error && lowest_us >= 0.0 && highest_us > lowest_us && highest_us < kMostUs) {
    facts.shortest_exposure = Duration(std::llround(lowest_us * 1e3));
    facts.longest_exposure = Duration(std::llround(highest_us * 1e3));
  }
  facts.can_set_exposure = facts.findings.Of("exposure") == nullptr;
  return {};
}

Result<void> ReadGainFacts(ArvCamera* camera, CameraFacts& facts) {
  if (arv_camera_is_gain_available(camera, nullptr) == 0) return {};
  CallError bounds_error, value_error;
  GainRange gain;
  arv_camera_get_gain_bounds(camera, &gain.lowest, &gain.highest, bounds_error.out());
  (void)arv_camera_get_gain(camera, value_error.out());
  for (const CallError* error : {&bounds_error, &value_error}) {
    if (!*error) continue;
    const Error why = error->Why("asking for the gain").error();
    if (CameraIsGone(why)) return PassOn(why);
    facts.findings.LeaveOut("gain", why);
  }
  if (!bounds_error && !(gain.lowest < gain.highest)) {
    facts.findings.LeaveOut(
        "gain", {Code::Unsupported, "the camera says that gains go from " + std::to_string(gain.lowest) + " to " +
                                        std::to_string(gain.highest)});
  }
  if (facts.findings.Of("gain") == nullptr) facts.gain = gain;
  return {};
}

Result<void> ReadFacts(ArvCamera* camera, const CameraConfig& config, CameraFacts& facts) {
  CallError region_error, rate_error;
  gint x = 0, y = 0;
  arv_camera_get_region(camera, &x, &y, &facts.width, &facts.height, region_error.out());
  if (region_error) return region_error.Why("asking for the size of the picture");
  const CameraIdentity identity = IdentityOf(camera);
  facts.model = identity.model;
  facts.serial = identity.serial;
  facts.pixel_um = config.pixel_um > 0.0 ? config.pixel_um : PixelPitch(camera);
  if (config.trigger.empty() && arv_camera_is_frame_rate_available(camera, nullptr)) {
    facts.frame_rate_hz = arv_camera_get_frame_rate(camera, rate_error.out());
    if (rate_error || !(facts.frame_rate_hz > 0.0)) facts.frame_rate_hz = 0.0;
  }
  if (auto read = ReadExposureFacts(camera, facts); !read) return read;
  return ReadGainFacts(camera, facts);
}

}  // namespace

CameraIdentity IdentityOf(ArvCamera* camera) {
  // Where reading a text fails, Aravis 0.8 returns memory without an end.
  const auto read = [&](const char* (*get)(ArvCamera*, GError**)) {
    CallError failed;
    const char* text = get(camera, failed.out());
    return failed ? std::string() : Text(text);
  };
  CameraIdentity identity;
  identity.model = read(arv_camera_get_vendor_name);
  const std::string model = read(arv_camera_get_model_name);
  identity.model += (identity.model.empty() || model.empty() ? "" : " ") + model;
  identity.serial = read(arv_camera_get_device_serial_number);
  return identity;
}

Result<CameraFacts> SetUpCamera(ArvCamera* camera, const CameraConfig& config) {
  // One that went away while it streamed may stream still.
  CallError ignored;
  arv_camera_stop_acquisition(camera, ignored.out());
  CameraFacts facts;
  for (const auto step : {SetTransport, SetRegion}) {
    if (auto done = step(camera, config); !done) return PassOn(done);
  }
  auto format = SetPixelFormat(camera, config.pixel_format);
  if (!format) return PassOn(format);
  facts.format = *format;
  if (auto done = SetPace(camera, config); !done) return PassOn(done);
  if (auto done = SetLight(camera, config, facts.findings); !done) return PassOn(done);
  if (auto done = ReadFacts(camera, config, facts); !done) return PassOn(done);
  return facts;
}

}  // namespace lensd::drivers::aravis
