// What drivers/api says, as io.lensd.Driver has it in JSON, in both directions. What is read is checked: a driver
// process may send anything. Functions that read fail with Code::Protocol and name the field that is wrong. Any thread.
#pragma once

#include <optional>
#include <string_view>

#include "base/result.h"
#include "base/settings.h"
#include "drivers/api/device.h"
#include "varlink/json.h"

namespace lensd::drivers::wire {

using varlink::Json;

/// Settings, and where each value was written: a JSON pointer and its file:line.
struct SentSettings {
  Json values;
  Json places;
};
/// BadData: a number that is not finite.
Result<SentSettings> SettingsJson(const Settings& settings);
Result<Settings> SettingsFrom(const Json& values, const Json& places);

/// What Describe answers.
struct Description {
  std::optional<Capabilities> lens;
  std::optional<CameraCapabilities> camera;
  Findings findings;
  std::optional<NominalOptics> optics;
};
Json DescriptionJson(const Device& device);
/// `driver`: how the configuration calls it.
Result<Description> DescriptionFrom(const Json& json, std::string_view driver);

Json StateJson(const LensState& state);
/// With every axis of `can` and no other. Where the reply has no time, or a later one, it is `now`.
Result<LensState> StateFrom(const Json& json, const Capabilities& can, Instant now);

Json CountersJson(const Counters& counters);
Result<Counters> CountersFrom(const Json& json);
Json UnusableJson(const UnusableFrames& unusable);
Result<UnusableFrames> UnusableFrom(const Json& json);
Json ExposureJson(const ExposureState& state);
Result<ExposureState> ExposureFrom(const Json& json);

/// A frame without its samples and colours.
Json FrameJson(const Frame& frame);
/// Of the size and depth that `can` says, or it is refused. No time is later than `now`.
Result<Frame> FrameFrom(const Json& json, const CameraCapabilities& can, Instant now);
/// Whether the frame says that it has colours.
bool FrameHasColour(const Json& json);

Json FoundJson(const FoundDevice& found);

/// The parameters of io.lensd.Driver.Failed.
Json ErrorJson(const Error& error);
/// Of codes that it does not know, Internal.
Error ErrorFrom(const Json& parameters);

/// How a line begins that a driver's process prints where the kernel cannot refuse it something.
inline constexpr std::string_view kNotConfined = "not confined: ";

double Milliseconds(Duration duration);
Duration FromMilliseconds(double ms);

}  // namespace lensd::drivers::wire
