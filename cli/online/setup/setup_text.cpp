// What `lensctl setup` has found, in lines for people, as lines for the configuration, and as JSON.
#include "cli/online/setup/setup_text.h"

#include <algorithm>
#include <cmath>

#include "cli/text/text.h"
#include "cli/text/texts.h"

namespace lensd::cli {
namespace {

using varlink::Json;

std::string IntervalText(const Json& measured, int digits, const char* unit) {
  if (!measured.is_object()) return "not known";
  return NumberText(measured, "value", digits, unit) + " (" + NumberText(measured, "low", digits, "") + " to " +
         NumberText(measured, "high", digits, ")");
}

std::string AxisText(const Json& axis) {
  const std::string unit = TextOf(axis, "unit") == "steps" ? " steps" : " " + TextOf(axis, "unit");
  std::string text = TextOf(axis, "axis") + ": " + NumberText(axis, "minimum", 6, " to ") +
                     NumberText(axis, "maximum", 6, unit.c_str()) + " as the device says, positions are " +
                     (axis["feedback"] == "none" ? "not told" : TextOf(axis, "feedback"));
  if (!axis.contains("speed")) return text + "\n";
  if (!axis["trouble"].is_null()) text += "\n  moves ended early: " + TextOf(axis, "trouble");
  text += "\n  speed      " +
          (axis["speed"].is_object()
               ? IntervalText(axis["speed"], 4, (unit + "/s").c_str())
               : "not measured: the time of its moves does not depend on their length, or they end before full speed");
  text += "\n  each move  " + IntervalText(axis["overheadMs"], 3, " ms") + " beside its travel, of " +
          NumberText(axis, "moves", 3, " moves");
  if (axis.value("seenOnTheWay", false)) {
    text += "\n  latency    " + IntervalText(axis["latencyMs"], 3, " ms") + " until its position changes";
    text += "\n  at rest    " + IntervalText(axis["restMs"], 3, " ms") + " after its last position";
  } else {
    text += "\n  its position is never seen in motion";
    if (axis["feedback"] == "none" || axis["feedback"] == "echo") {
      text += ": no position is read back, so the driver or settle_ms decides when a move ends";
    }
  }
  return text + "\n";
}

std::string BlurText(const SetupFindings& found) {
  std::string text;
  if (const auto& slope = found.slope.px_per_step) {
    text = "one step of focus is " + Short(slope->value, 4) + " px of blur (" + Short(slope->low, 4) + " to " +
           Short(slope->high, 4) + ")" + (found.f_number > 0.0 ? " at f/" + Short(found.f_number, 3) : "") + ", by " +
           std::to_string(found.slope.pictures) + " pictures";
  } else if (!found.slope.why_not.empty()) {
    text = "blur of a step: not measured: " + found.slope.why_not;
  }
  if (found.blur_px_per_step > 0.0) {
    text += (text.empty() ? "one step of focus is " : "; ") + Short(found.blur_px_per_step, 4) +
            " px by the optics configured";
  }
  return text.empty() ? "" : text + "\n";
}

/// "1.32 m"; what lies at infinity or past it has no distance.
std::string DistanceText(double vergence) {
  return vergence > 0.0 ? Short(1.0 / vergence, 4) + " m" : "infinity";
}

std::string CurveText(const NominalCurve& curve) {
  std::string text =
      "nominal curve, by that blur, the distance given and the focal length configured (distances from the "
      "lens centre):\n";
  for (const NominalCurve::Point& point : curve.points) {
    text += "  position " + Short(point.position, 6) + "  " + DistanceText(point.vergence.value) + " (" +
            DistanceText(point.vergence.high) + " to " + DistanceText(point.vergence.low) + "), extension " +
            Short(point.extension_mm.value, 4) + " mm (" + Short(point.extension_mm.low, 4) + " to " +
            Short(point.extension_mm.high, 4) + ")\n";
  }
  return text;
}

std::string SeenText(const std::string& seen) {
  return seen == "nearPositive" ? "near-positive" : "near-negative";
}

std::string DirectionText(const SetupFindings& found) {
  const auto focus = std::ranges::find_if(found.info["axes"], [](const Json& a) { return a["axis"] == "focus"; });
  const bool unknown =
      focus != found.info["axes"].end() && focus->contains("direction") && focus->at("direction").is_null();
  if (found.direction == "undecided") {
    return "direction: the subject fits both ways (it is in the middle of the travel, or the optics are not those "
           "configured); try another distance\n";
  }
  if (!found.seen && found.asked) {
    return "direction: not tried, because the autofocus did not focus on the subject at that distance: make it answer, "
           "or set direction in [lens.focus]\n";
  }
  if (!found.seen) {
    return std::string("direction: ") +
           (unknown ? "not known, so that no move to a distance is possible; " : "not tried; ") +
           "--at DISTANCE tries it on a subject in the picture whose distance is known\n";
  }
  if (found.direction == "right") return "direction: " + SeenText(*found.seen) + ", as expected\n";
  if (found.goes_by_seen) {
    return "direction: " + SeenText(*found.seen) + "; lensd uses it from now on, also after a restart\n";
  }
  if (focus != found.info["axes"].end() && TextOf(*focus, "directionFrom") == "calibration") {
    return "direction: reversed: " + SeenText(*found.seen) + ", but the calibration says otherwise; measure it again\n";
  }
  return "direction: reversed; in [lens.focus] say the other one of near-positive and near-negative\n";
}

/// What goes into the configuration.
std::string ConfigurationText(const SetupFindings& found) {
  std::string text;
  for (const Json& axis : found.axes) {
    std::string lines;
    if (axis.contains("speed") && axis["speed"].is_object()) {
      lines += "speed = " + NumberText(axis["speed"], "value", 4, "\n");
    }
    if (axis["axis"] == "focus" && found.backlash.is_object() && found.backlash.value("known", false)) {
      lines += "backlash = " + std::to_string(std::lround(std::ceil(found.backlash["sizeHigh"].get<double>()))) + "\n";
    }
    if (!lines.empty()) text += "[lens." + TextOf(axis, "axis") + "]\n" + lines;
  }
  if (found.curve) {
    const Measured &first = found.curve->points.front().extension_mm, &last = found.curve->points.back().extension_mm;
    const Measured &far = first.value < last.value ? first : last, &near = first.value < last.value ? last : first;
    const Json& optics = found.info["optics"];
    text += "[lens.optics]  # nominal: the ends of focus by the blur of a step, " + Short(far.low, 4) + " to " +
            Short(far.high, 4) + " and " + Short(near.low, 4) + " to " + Short(near.high, 4) +
            " mm\nfocal_length_mm = " + NumberText(optics, "focalLengthMm", 6, "\nf_number = [") +
            NumberText(optics, "fNumberMin", 4, ", ") + NumberText(optics, "fNumberMax", 4, "]\nextension_mm = [") +
            Short(far.value, 4) + ", " + Short(near.value, 4) + "]\n";
  }
  return text.empty() ? "" : "\nfor the configuration of " + TextOf(found.info, "name") + ":\n" + text;
}

Json CurveJson(const NominalCurve& curve) {
  Json points = Json::array();
  for (const NominalCurve::Point& point : curve.points) {
    points.push_back({{"position", point.position},
                      {"extensionMm", JsonOf(point.extension_mm)},
                      {"vergenceD", JsonOf(point.vergence)}});
  }
  return points;
}

}  // namespace

std::string SetupText(const SetupFindings& found) {
  std::string text;
  for (const Json& axis : found.axes) text += AxisText(axis);
  if (found.info["camera"].is_null()) {
    text += "no camera: neither focus nor backlash can be measured\n";
  } else if (found.autofocus.is_object()) {
    text += AutofocusText(found.autofocus) + "\n";
    if (found.backlash.is_object()) text += BacklashLine(found.backlash) + "\n";
    text += BlurText(found);
    text += DirectionText(found);
    if (found.curve) text += CurveText(*found.curve);
  }
  for (const std::string& remark : found.remarks) text += remark + "\n";
  return text + ConfigurationText(found);
}

Json SetupJson(const SetupFindings& found, double elapsed_ms) {
  return {{"lens", found.info["name"]},
          {"axes", found.axes},
          {"autofocus", found.autofocus},
          {"backlash", found.backlash},
          {"direction", found.direction},
          {"seenDirection", found.seen ? Json(SeenText(*found.seen)) : Json(nullptr)},
          {"blurPxPerStep", found.blur_px_per_step > 0.0 ? Json(found.blur_px_per_step) : Json(nullptr)},
          {"blurSlope", JsonOf(found.slope.px_per_step)},
          {"blurSlopePictures", found.slope.pictures},
          {"blurSlopeWhyNot", found.slope.why_not.empty() ? Json(nullptr) : Json(found.slope.why_not)},
          {"fNumber", found.f_number > 0.0 ? Json(found.f_number) : Json(nullptr)},
          {"nominalCurve", found.curve ? CurveJson(*found.curve) : Json(nullptr)},
          {"remarks", found.remarks},
          {"elapsedMs", elapsed_ms}};
}

}  // namespace lensd::cli
