// Capabilities, findings and optics. What is not known is left out.
#include <algorithm>
#include <cmath>
#include <mutex>
#include <set>
#include <utility>

#include "drivers/wire/wire.h"
#include "fields.h"
#include "words.h"

namespace lensd::drivers::wire {
namespace {

constexpr double kMost = 1e15;           ///< of native units: whole numbers up to this are exact in a double
constexpr double kLongestMs = 86'400e3;  ///< of any exposure or settling time
constexpr std::int64_t kMostPixels = 200'000'000;
constexpr std::size_t kMostVouchers = 64;

Json AxisJson(Axis axis, const AxisCapabilities& can) {
  Json json{{"axis", AxisName(axis)},       {"unit", WordOf(UnitWords(), can.unit)},
            {"minimum", can.minimum.value}, {"maximum", can.maximum.value},
            {"resolution", can.resolution}, {"feedback", WordOf(FeedbackWords(), can.feedback)},
            {"canHome", can.can_home},      {"needsHome", can.needs_home},
            {"canStop", can.can_stop},      {"settleMs", Milliseconds(can.settle)}};
  if (can.counts) json["lowestCount"] = can.counts->first.value;
  if (can.counts) json["highestCount"] = can.counts->second.value;
  if (can.speed > 0.0) json["speed"] = can.speed;
  if (can.backlash >= 0.0) json["backlash"] = can.backlash;
  if (can.lost_travel >= 0.0) json["lostTravel"] = can.lost_travel;
  if (can.direction) json["direction"] = WordOf(DirectionWords(), can.direction->direction);
  if (can.direction) json["directionBy"] = can.direction->by;
  return json;
}

Json OrNull(const std::string& text) {
  return text.empty() ? Json(nullptr) : Json(text);
}

Json LensJson(const Capabilities& can) {
  Json axes = Json::array();
  for (const Axis axis : kAxes) {
    if (can.axes[axis]) axes.push_back(AxisJson(axis, *can.axes[axis]));
  }
  return {{"model", can.model}, {"serial", OrNull(can.serial)}, {"axes", std::move(axes)}};
}

Json CameraJson(const CameraCapabilities& can) {
  const Region& region = can.focus_region;
  Json json{{"model", can.model},
            {"serial", OrNull(can.serial)},
            {"widthPx", can.width},
            {"heightPx", can.height},
            {"bits", can.bits},
            {"colour", can.colour},
            {"onDemand", can.on_demand},
            {"pixelUm", can.pixel_um},
            {"frameRateHz", can.frame_rate_hz},
            {"canSetExposure", can.can_set_exposure},
            {"shortestExposureMs", Milliseconds(can.shortest_exposure)},
            {"longestExposureMs", Milliseconds(can.longest_exposure)},
            {"exposureStepMs", Milliseconds(can.exposure_step)},
            {"focusRegion", {{"x", region.x}, {"y", region.y}, {"width", region.width}, {"height", region.height}}}};
  if (can.gain) {
    json["gain"] = {{"lowest", can.gain->lowest},
                    {"highest", can.gain->highest},
                    {"unit", WordOf(GainUnitWords(), can.gain->unit)},
                    {"step", can.gain->step}};
  }
  return json;
}

Json OpticsJson(const NominalOptics& optics) {
  return {{"focalLengthMm", 1e3 * optics.focal_length_m},
          {"maxFocalLengthMm", 1e3 * optics.max_focal_length_m},
          {"centreShiftMm", 1e3 * optics.centre_shift_m},
          {"minFNumber", optics.min_f_number},
          {"maxFNumber", optics.max_f_number},
          {"minExtensionMm", 1e3 * optics.min_extension_m},
          {"maxExtensionMm", 1e3 * optics.max_extension_m},
          {"liquid", optics.liquid}};
}

/// KnownDirection::by outlives every device, so what processes say is kept for ever: only so many of them.
std::string_view Voucher(const std::string& by) {
  static std::mutex mutex;
  static std::set<std::string, std::less<>> known;
  const std::lock_guard lock(mutex);
  if (by.empty() || (!known.contains(by) && known.size() >= kMostVouchers)) return "the driver";
  return *known.insert(by).first;
}

Result<void> ReadAxis(const Json& json, const std::string& what, Capabilities& lens) {
  Fields read(json, what);
  const Axis axis = kAxes[read.Word("axis", AxisWords())];
  AxisCapabilities can;
  can.unit = static_cast<NativeUnit>(read.Word("unit", UnitWords()));
  can.minimum = Native{read.Number("minimum", -kMost, kMost)};
  can.maximum = Native{read.Number("maximum", -kMost, kMost)};
  if (can.maximum <= can.minimum) read.Reject("maximum", "must be above minimum");
  can.resolution = read.Number("resolution", std::numeric_limits<double>::min(), kMost);
  const auto lowest = read.MaybeNumber("lowestCount", -kMost, kMost);
  const auto highest = read.MaybeNumber("highestCount", -kMost, kMost);
  if (lowest || highest) {
    can.counts = {Native{lowest.value_or(can.minimum.value)}, Native{highest.value_or(can.maximum.value)}};
    if (can.counts->second <= can.counts->first) read.Reject("highestCount", "must be above lowestCount");
  }
  can.feedback = static_cast<Feedback>(read.Word("feedback", FeedbackWords()));
  can.can_home = read.FlagOr("canHome", false);
  can.needs_home = read.FlagOr("needsHome", false);
  if (can.needs_home && !can.can_home) read.Reject("needsHome", "is true, and canHome is not");
  can.can_stop = read.FlagOr("canStop", true);
  can.speed = read.NumberOr("speed", 0.0, 0.0, kMost);
  can.settle = FromMilliseconds(read.NumberOr("settleMs", 0.0, 0.0, kLongestMs));
  can.backlash = read.NumberOr("backlash", -1.0, 0.0, kMost);
  can.lost_travel = read.NumberOr("lostTravel", -1.0, 0.0, 1.0);
  if (const auto direction = read.MaybeWord("direction", DirectionWords())) {
    can.direction = KnownDirection{static_cast<Direction>(*direction), Voucher(read.TextOr("directionBy", ""))};
  }
  if (lens.axes[axis]) read.Reject("axis", "has been described already");
  lens.axes[axis] = can;
  return read.Finish();
}

Result<Capabilities> ReadLens(const Json& json, std::string_view driver) {
  Fields read(json, "lens");
  Capabilities can;
  can.driver = driver;
  can.model = read.Text("model");
  can.serial = read.TextOr("serial", "");
  int index = 0;
  for (const Json& axis : read.Elements("axes")) {
    read.Take(ReadAxis(axis, "lens.axes[" + std::to_string(index++) + "]", can));
  }
  if (auto done = read.Finish(); !done) return PassOn(done);
  return can;
}

Result<GainRange> ReadGain(const Json& json) {
  Fields read(json, "camera.gain");
  GainRange range;
  range.lowest = read.Number("lowest", -kMost, kMost);
  range.highest = read.Number("highest", -kMost, kMost);
  if (range.highest < range.lowest) read.Reject("highest", "must not be below lowest");
  range.unit = static_cast<GainUnit>(read.Word("unit", GainUnitWords()));
  range.step = read.NumberOr("step", 0.0, 0.0, kMost);
  if (auto done = read.Finish(); !done) return PassOn(done);
  return range;
}

Result<Region> ReadRegion(const Json& json) {
  Fields read(json, "camera.focusRegion");
  Region region;
  region.x = read.Number("x", 0.0, 1.0);
  region.y = read.Number("y", 0.0, 1.0);
  region.width = read.Number("width", 1e-6, 1.0);
  region.height = read.Number("height", 1e-6, 1.0);
  if (region.x + region.width > 1.0 + 1e-9) read.Reject("width", "goes beyond the frame");
  if (region.y + region.height > 1.0 + 1e-9) read.Reject("height", "goes beyond the frame");
  if (auto done = read.Finish(); !done) return PassOn(done);
  region.width = std::min(region.width, 1.0 - region.x);
  region.height = std::min(region.height, 1.0 - region.y);
  return region;
}

Result<CameraCapabilities> ReadCamera(const Json& json, std::string_view driver) {
  Fields read(json, "camera");
  CameraCapabilities can;
  can.driver = driver;
  can.model = read.Text("model");
  can.serial = read.TextOr("serial", "");
  can.width = static_cast<int>(read.Integer("widthPx", 1, 65535));
  can.height = static_cast<int>(read.Integer("heightPx", 1, 65535));
  if (std::int64_t{can.width} * can.height > kMostPixels) read.Reject("heightPx", "makes frames too large");
  can.bits = static_cast<int>(read.Integer("bits", 8, 16));
  can.colour = read.FlagOr("colour", false);
  can.on_demand = read.FlagOr("onDemand", false);
  can.pixel_um = read.NumberOr("pixelUm", 0.0, 0.0, 1e6);
  can.frame_rate_hz = read.NumberOr("frameRateHz", 0.0, 0.0, 1e6);
  can.can_set_exposure = read.FlagOr("canSetExposure", false);
  can.shortest_exposure = FromMilliseconds(read.NumberOr("shortestExposureMs", 0.0, 0.0, kLongestMs));
  can.longest_exposure = FromMilliseconds(read.NumberOr("longestExposureMs", 0.0, 0.0, kLongestMs));
  can.exposure_step = FromMilliseconds(read.NumberOr("exposureStepMs", 0.0, 0.0, kLongestMs));
  if (const Json* gain = read.Object("gain")) {
    auto range = ReadGain(*gain);
    if (!range) return PassOn(range);
    can.gain = *range;
  }
  if (const Json* region = read.Object("focusRegion")) {
    auto where = ReadRegion(*region);
    if (!where) return PassOn(where);
    can.focus_region = *where;
  }
  if (auto done = read.Finish(); !done) return PassOn(done);
  return can;
}

Result<NominalOptics> ReadOptics(const Json& json) {
  Fields read(json, "optics");
  const auto metres = [&](const char* key, double lowest) { return 1e-3 * read.NumberOr(key, 0.0, lowest, 1e6); };
  NominalOptics optics;
  optics.focal_length_m = 1e-3 * read.Number("focalLengthMm", std::numeric_limits<double>::min(), 1e6);
  optics.max_focal_length_m = metres("maxFocalLengthMm", 0.0);
  optics.centre_shift_m = metres("centreShiftMm", -1e6);
  optics.min_f_number = read.NumberOr("minFNumber", 0.0, 0.0, 1e4);
  optics.max_f_number = read.NumberOr("maxFNumber", 0.0, 0.0, 1e4);
  optics.min_extension_m = metres("minExtensionMm", -1e6);
  optics.max_extension_m = metres("maxExtensionMm", -1e6);
  optics.liquid = read.FlagOr("liquid", false);
  if (auto done = read.Finish(); !done) return PassOn(done);
  return optics;
}

Result<Findings> ReadFindings(Fields& read) {
  Findings findings;
  for (const Json& one : read.Elements("leftOut")) {
    Fields part(one, "leftOut");
    const std::string name = part.Text("part");
    const std::string reason = part.Text("reason");
    findings.LeaveOut(name, {CodeFromWord(part.Text("code")), reason});
    if (auto done = part.Finish(); !done) return PassOn(done);
  }
  for (const Json& doubt : read.Elements("doubts")) {
    if (!doubt.is_string()) return Fail(Code::Protocol, "doubts must be strings");
    findings.Doubt(doubt.get<std::string>().substr(0, Fields::kLongestText));
  }
  return findings;
}

}  // namespace

Json DescriptionJson(const Device& device) {
  Json left_out = Json::array(), doubts = Json::array();
  for (const LeftOut& one : device.findings.left_out()) {
    left_out.push_back({{"part", one.part}, {"reason", one.reason}, {"code", CodeWord(one.code)}});
  }
  for (const std::string& doubt : device.findings.doubts()) doubts.push_back(doubt);
  Json json{{"leftOut", std::move(left_out)}, {"doubts", std::move(doubts)}};
  if (device.lens) json["lens"] = LensJson(device.lens->capabilities());
  if (device.camera) json["camera"] = CameraJson(device.camera->capabilities());
  if (device.optics) json["optics"] = OpticsJson(*device.optics);
  return json;
}

Result<Description> DescriptionFrom(const Json& json, std::string_view driver) {
  Fields read(json, "the description");
  Description description;
  if (const Json* found = read.Object("lens")) {
    auto lens = ReadLens(*found, driver);
    if (!lens) return PassOn(lens);
    description.lens = *std::move(lens);
  }
  if (const Json* found = read.Object("camera")) {
    auto camera = ReadCamera(*found, driver);
    if (!camera) return PassOn(camera);
    description.camera = *std::move(camera);
  }
  if (const Json* found = read.Object("optics")) {
    auto optics = ReadOptics(*found);
    if (!optics) return PassOn(optics);
    description.optics = *optics;
  }
  auto findings = ReadFindings(read);
  if (!findings) return PassOn(findings);
  description.findings = *std::move(findings);
  if (!description.lens && !description.camera)
    read.Reject("lens", "and camera are missing: one of them must be there");
  if (auto done = read.Finish(); !done) return PassOn(done);
  return description;
}

Json FoundJson(const FoundDevice& found) {
  return {{"model", found.model},
          {"serial", OrNull(found.serial)},
          {"node", OrNull(found.node)},
          {"config", found.config},
          {"lens", found.lens},
          {"camera", found.camera},
          {"problem", OrNull(found.problem)}};
}

}  // namespace lensd::drivers::wire
