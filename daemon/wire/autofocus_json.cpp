// Autofocus as the interface's types.
#include <array>
#include <vector>

#include "daemon/lens/lens_slope.h"
#include "daemon/wire/json_values.h"
#include "daemon/wire/lens_json.h"
#include "daemon/wire/search_conditions_json.h"

namespace lensd::daemon {

using varlink::Json;

namespace {

Json SamplesJson(const std::vector<rig::AutofocusSample>& samples) {
  static constexpr std::array<std::string_view, 3> kStates = {"standing", "moving", "backlashOpen"};
  Json json = Json::array();
  for (const rig::AutofocusSample& sample : samples) {
    json.push_back({{"frame", sample.frame + 1},
                    {"region", sample.region},
                    {"state", NameIn(kStates, sample.state)},
                    {"position", NativeJson(sample.position.value)},
                    {"positionBound", varlink::NumberOrNull(sample.bound.value)},
                    {"vergenceD", Optional(sample.vergence)},
                    {"score", sample.score},
                    {"scoreSigma", sample.score_sigma},
                    {"exposureStartNs", sample.exposure_start.time_since_epoch().count()},
                    {"exposureEndNs", sample.exposure_end.time_since_epoch().count()}});
  }
  return json;
}

Json SubjectJson(const std::optional<rig::AutofocusSubject>& subject) {
  if (!subject) return nullptr;
  static constexpr std::array<std::string_view, 3> kFoundBy = {"sharpness", "blur", "stars"};
  return {{"region", subject->region},
          {"foundBy", NameIn(kFoundBy, subject->by)},
          {"position", NativeJson(subject->position.value)},
          {"vergenceD", Optional(subject->vergence)},
          {"focalPlaneM", DistanceJson(subject->vergence)},
          {"sigmaD", Optional(subject->sigma)}};
}

Json StarsJson(const std::optional<autofocus::StarFigures>& stars) {
  if (!stars) return nullptr;
  return {{"count", stars->count},
          {"clipped", stars->clipped},
          {"hfrPx", stars->hfr_px ? Json(*stars->hfr_px) : Json()},
          {"fwhmPx", stars->fwhm_px ? Json(*stars->fwhm_px) : Json()}};
}

Json RegionsJson(const std::vector<drivers::Region>& regions) {
  Json json = Json::array();
  for (const drivers::Region& region : regions) {
    json.push_back({{"x", region.x}, {"y", region.y}, {"w", region.width}, {"h", region.height}});
  }
  return json;
}

}  // namespace

std::string_view AutofocusCauseName(autofocus::Cause cause) {
  static constexpr std::array<std::string_view, 14> kNames = {
      "noTexture",    "tooBright",    "severalDepths", "endOfTravel", "subjectMoved", "ambiguous",   "unclear",
      "uncalibrated", "placeUnknown", "deadline",      "missed",      "sameFrame",    "notRestored", "lateFrames"};
  return NameIn(kNames, cause);
}

Json AutofocusJson(const std::string& name, const rig::AutofocusOutcome& outcome) {
  Json candidates = Json::array();
  for (const rig::AutofocusCandidate& candidate : outcome.candidates) {
    candidates.push_back({{"region", candidate.region},
                          {"position", NativeJson(candidate.position.value)},
                          {"vergenceD", Optional(candidate.vergence)}});
  }
  Json json{{"lens", name},
            {"focused", outcome.focused},
            {"method", outcome.method},
            {"frames", outcome.frames},
            {"moves", outcome.moves},
            {"elapsedMs", Milliseconds(outcome.elapsed)},
            {"vergenceD", Optional(outcome.vergence)},
            {"sigmaD", Optional(outcome.sigma)},
            {"position", NativeJson(outcome.position.value)},
            {"confidence", outcome.confidence},
            {"cause", outcome.focused ? "found" : AutofocusCauseName(outcome.cause)},
            {"reason", outcome.reason},
            {"subject", SubjectJson(outcome.subject)},
            {"samples", SamplesJson(outcome.samples)},
            {"regions", RegionsJson(outcome.regions)},
            {"stars", StarsJson(outcome.stars)},
            {"slope", AutofocusSlopeJson(outcome)},
            {"conditions", outcome.under ? SearchedUnderJson(*outcome.under) : Json(nullptr)}};
  if (!candidates.empty()) json["candidates"] = std::move(candidates);
  Json left_out = Json::array();
  for (const rig::LeftOutFrame& one : outcome.left_out) {
    left_out.push_back(
        {{"frame", one.frame + 1}, {"position", NativeJson(one.position.value)}, {"reason", one.reason}});
  }
  if (!left_out.empty()) json["framesLeftOut"] = std::move(left_out);
  if (outcome.lag_frames) json["lagFrames"] = *outcome.lag_frames;
  return json;
}

Json AutofocusProgressJson(const rig::AutofocusProgress& progress) {
  return {{"frames", progress.frames},
          {"moves", progress.moves},
          {"framesExpected", progress.frames_expected},
          {"position", NativeJson(progress.position.value)},
          {"sharpness", varlink::NumberOrNull(progress.sharpness)},
          {"samples", SamplesJson(progress.samples)}};
}

Json FrameWantedJson(const rig::FrameWanted& wanted) {
  return {{"frame", wanted.number},
          {"framesExpected", wanted.frames_expected},
          {"position", NativeJson(wanted.position.value)},
          {"extensionMm", Optional(wanted.extension, kMmPerMetre)},
          {"vergenceD", Optional(wanted.vergence)},
          {"settledAtNs", wanted.since.time_since_epoch().count()},
          {"samples", SamplesJson(wanted.samples)}};
}

}  // namespace lensd::daemon
