// The daemon's answers in words and figures for people. Scripts use --json.
#include "cli/text/texts.h"

#include <chrono>
#include <cmath>

#include "cli/text/text.h"

namespace lensd::cli {
namespace {

using varlink::Json;

bool Has(const Json& object, const char* key) {
  return object.contains(key) && !object[key].is_null();
}

bool True(const Json& object, const char* key) {
  return object.value(key, false);
}

/// What is to be said of an axis whose position means nothing.
std::string WhereText(const Json& axis) {
  if (Has(axis, "positionUnknown") && True(axis, "positionUnknown")) return " (position unknown: lensctl here)";
  return True(axis, "homed") ? "" : " (not homed)";
}

/// "focused at 1.25 m (0.8 D)", "focused at infinity".
std::string FocusText(const Json& object) {
  if (!Has(object, "vergenceD")) return "";
  const double vergence = object["vergenceD"].get<double>();
  if (vergence == 0.0) return ", focused at infinity";
  return ", focused " + std::string(vergence < 0.0 ? "" : "at ") + DepthText({vergence}) +
         std::string(vergence > 0.0 ? OriginWords() : "");
}

/// One line for each part that a lens goes without.
std::string PartsText(const Json& lens) {
  std::string lines;
  if (!Has(lens, "leftOut")) return lines;
  for (const Json& one : lens["leftOut"]) {
    lines += "\n  without " + TextOf(one, "part") + ": " + TextOf(one, "reason");
  }
  return lines;
}

/// Of a driver that has a process of its own.
std::string ProcessText(const Json& info, const char* key) {
  return Has(info, key) ? " (driver in process " + NumberText(info, key, 9, "") + ")" : "";
}

}  // namespace

std::string LagsText(const Json& learned) {
  std::string lines;
  if (!Has(learned, "lags")) return lines;
  for (const Json& lag : learned["lags"]) {
    const int frames = lag.value("frames", 0);
    const bool outside = lag.value("framesFromOutside", false);
    if (!outside && frames == 0) continue;  // as expected of its own camera
    lines += "\n  pictures of ";
    lines += outside ? "a client's camera" : "its own camera";
    if (lag.value("pixelUm", 0.0) > 0.0) lines += ", " + NumberText(lag, "pixelUm", 4, " um a pixel");
    lines += frames == 0 ? ": in time" : ": " + std::to_string(frames) + (frames == 1 ? " frame late" : " frames late");
  }
  return lines;
}

std::string TextOf(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

std::string NumberText(const Json& object, const char* key, int digits, const char* unit) {
  if (!Has(object, key)) return "?";
  const double value = object[key].get<double>();
  // Counts are shown whole.
  if (value == std::floor(value) && std::abs(value) < 1e15) return std::to_string(std::llround(value)) + unit;
  return Short(value, digits) + unit;
}

std::string TimeText(const Json& object, const char* key) {
  if (!Has(object, key)) return "?";
  const double ms = object[key].get<double>();
  return ms < 1e3 ? Short(ms, 3) + " ms" : Short(1e-3 * ms, 3) + " s";
}

std::string FocusDirectionText(const Json& axis) {
  if (!Has(axis, "direction")) return "direction unknown";
  const std::string direction = axis["direction"] == "nearPositive" ? "near-positive" : "near-negative";
  const std::string from = TextOf(axis, "directionFrom");
  if (from == "configured") return direction + ", configured";
  if (from == "calibration") return direction + ", by its calibration";
  if (from == "seen") return direction + ", seen by setup";
  return direction + ", by " + TextOf(axis, "directionBy");
}

std::string InfoText(const Json& info) {
  std::string line =
      TextOf(info, "name") + ": " + TextOf(info, "driver") + " " + TextOf(info, "model") + ProcessText(info, "process");
  for (const Json& axis : info["axes"]) {
    line += ", " + TextOf(axis, "axis") + " " + NumberText(axis, "minimum", 8, "") + ".." +
            NumberText(axis, "maximum", 8, " ") +
            (TextOf(axis, "unit") == "fNumber" ? "f-number" : TextOf(axis, "unit"));
    if (axis["axis"] == "focus" && axis.contains("direction")) line += " (" + FocusDirectionText(axis) + ")";
    if (Has(axis, "referenced") && !True(axis, "referenced")) line += " (not referenced)";
  }
  if (Has(info, "optics")) {
    const Json& optics = info["optics"];
    const std::string widest = NumberText(optics, "fNumberMin", 4, ""),
                      smallest = NumberText(optics, "fNumberMax", 4, "");
    line += ", " + NumberText(optics, "focalLengthMm", 6, " mm") + " f/" + widest;
    if (smallest != widest) line += ".." + smallest;
  }
  if (Has(info, "optics") && Has(info["optics"], "grade")) {
    line += ", " + TextOf(info["optics"], "grade");
    if (Has(info["optics"], "calibrationErrorUm")) {
      line += " within " + NumberText(info["optics"], "calibrationErrorUm", 3, " um");
    }
  }
  if (Has(info, "camera")) {
    const Json& camera = info["camera"];
    line += ", camera " + NumberText(camera, "widthPx", 6, "x") + NumberText(camera, "heightPx", 6, " px") +
            ProcessText(info, "cameraProcess");
  }
  return line + PartsText(info) + LagsText(info);
}

std::string RefocusText(const Json& refocus) {
  std::string line = "refocus by " + TextOf(refocus, "cause") + ", " + TextOf(refocus, "end");
  if (refocus["byUm"].is_number()) line += " by " + NumberText(refocus, "byUm", 4, " um of extension");
  if (refocus["temperatureC"].is_number()) line += " at " + NumberText(refocus, "temperatureC", 4, " C");
  return line + ": " + TextOf(refocus, "reason");
}

std::string UntilText(const Json& until_ns) {
  const std::chrono::nanoseconds until(until_ns.get<std::int64_t>());
  const auto left = until - std::chrono::steady_clock::now().time_since_epoch();
  return " for another " + std::to_string(std::chrono::ceil<std::chrono::seconds>(left).count()) + " s";
}

std::string StatusText(const Json& status) {
  std::string line = TextOf(status, "name") + ": ";
  line += True(status, "connected") ? TextOf(status, "activity") : "disconnected";
  if (status.value("stepsExpected", 0) > 0) {
    line += " " + NumberText(status, "step", 9, "") + " of " + NumberText(status, "stepsExpected", 9, "");
  }
  line += FocusText(status);
  if (Has(status, "grade")) {
    line += " (" + TextOf(status, "grade");
    line += Has(status, "calibrationErrorUm") ? " within " + NumberText(status, "calibrationErrorUm", 3, " um)") : ")";
  }
  if (Has(status, "fNumber")) line += ", f/" + NumberText(status, "fNumber", 4, "");
  for (const Json& axis : status["axes"]) {
    line += ", " + TextOf(axis, "axis") +
            (Has(axis, "lastKnown") && True(axis, "lastKnown") ? " last known at " : " ") +
            NumberText(axis, "position", 8, "");
    if (True(axis, "moving")) {
      line += " -> " + NumberText(axis, "target", 8, "");
    } else if (Has(axis, "positionBound") && axis["positionBound"].get<double>() > 1.0) {
      line += " within " + NumberText(axis, "positionBound", 3, "");
    }
    line += WhereText(axis);
    if (Has(axis, "movedBy") && TextOf(axis, "movedBy") == "external") line += " (moved by another program)";
    if (!TextOf(axis, "fault").empty()) line += " (" + TextOf(axis, "fault") + ")";
  }
  if (Has(status, "temperatureC")) line += ", " + NumberText(status, "temperatureC", 4, " C");
  if (Has(status, "temperatureFault")) line += " (thermometer: " + TextOf(status, "temperatureFault") + ")";
  if (Has(status, "holdUntilNs")) line += ", corrections wait" + UntilText(status["holdUntilNs"]);
  if (Has(status, "error")) line += "; " + TextOf(status, "error");
  if (Has(status, "warnings")) {
    for (const Json& warning : status["warnings"]) line += "\n  " + warning.get<std::string>();
  }
  line += PartsText(status);
  if (Has(status, "unwritten")) {
    for (const Json& file : status["unwritten"]) {
      line += "\n  " + TextOf(file, "file") +
              " on disk: older than this, since lensd cannot write: " + TextOf(file, "reason");
    }
  }
  return line;
}

std::string ActivityText(const Json& status) {
  std::string line = TextOf(status, "name") + ": ";
  line += True(status, "connected") ? TextOf(status, "activity") : "disconnected";
  if (status.value("stepsExpected", 0) > 0) {
    line += ", step " + NumberText(status, "step", 9, "") + " of about " + NumberText(status, "stepsExpected", 9, "");
  }
  bool focus_moves = false;
  for (const Json& axis : status["axes"]) {
    if (!True(axis, "moving")) continue;
    focus_moves |= TextOf(axis, "axis") == "focus";
    line += ", " + TextOf(axis, "axis") + " at " + NumberText(axis, "position", 5, "");
    if (TextOf(status, "activity") != "homing") line += " on its way to " + NumberText(axis, "target", 5, "");
  }
  return line + (focus_moves ? FocusText(status) : "");
}

std::string StandsText(const Json& status) {
  std::string line = TextOf(status, "name") + ":" + (True(status, "connected") ? "" : " disconnected, last known");
  const char* before = " ";
  for (const Json& axis : status["axes"]) {
    line += before + TextOf(axis, "axis") + (True(axis, "moving") ? " still moving, at " : " at ") +
            NumberText(axis, "position", 8, "");
    if (Has(axis, "positionBound")) line += " within " + NumberText(axis, "positionBound", 3, "");
    line += WhereText(axis);
    before = ", ";
  }
  line += FocusText(status);
  if (Has(status, "vergenceBoundD")) line += " within " + NumberText(status, "vergenceBoundD", 2, " D");
  if (Has(status, "fNumber")) line += ", f/" + NumberText(status, "fNumber", 4, "");
  return line;
}

namespace {

/// Of a histogram.
std::string MeanText(const Json& histogram) {
  const auto count = histogram.value("count", std::int64_t{0});
  if (count == 0) return "-";
  const Json mean{{"ms", histogram.value("sumMs", 0.0) / static_cast<double>(count)}};
  return NumberText(mean, "ms", 3, " ms on average");
}

}  // namespace

std::string MetricsText(const Json& metrics) {
  const auto count = [](const Json& of, const char* key) { return std::to_string(of.value(key, std::int64_t{0})); };
  const Json& lost = metrics["counters"];
  std::string text = TextOf(metrics, "lens");
  const auto row = [&](std::string_view name, const std::string& what) {
    text += "\n  " + std::string(name) + std::string(10 - name.size(), ' ') + what;
  };
  const bool whole = Has(metrics, "waitMs") && Has(metrics, "settleMs");
  row("moves",
      count(metrics, "moves") + ", " + count(metrics, "movesReached") + " reached, " + count(metrics, "movesVerified") +
          " verified" +
          (whole ? ", " + count(metrics, "movesMissed") + " missed; took " + MeanText(metrics["settleMs"]) : ""));
  row("searches", count(metrics, "autofocuses") + ", " + count(metrics, "autofocusesFocused") + " focused");
  const std::string damaged = ", " + count(lost, "framesDamaged") + " of them damaged, ";
  const std::string flawed = ", " + count(metrics, "framesFlawed") + " shown with flaws";
  row("frames", count(metrics, "frames") + ", " + count(lost, "framesLost") + " lost" +
                    (Has(lost, "framesDamaged") ? damaged : ", ") + count(lost, "framesLate") + " late" +
                    (Has(metrics, "framesFlawed") ? flawed : "") + "; packets: " + count(lost, "packetsLost") +
                    " lost, " + count(lost, "packetsResent") + " sent again");
  if (whole) {
    row("calls", count(metrics, "refused") + " refused, " + count(metrics, "commandsWaiting") + " waiting; waited " +
                     MeanText(metrics["waitMs"]));
  }
  row("device",
      (whole ? "opened " + count(metrics, "openings") + "x, failed " + count(metrics, "failures") + "x; " : "") +
          count(lost, "busErrors") + " bus errors");
  return text;
}

std::string MoveText(const Json& move) {
  std::string line = TextOf(move, "lens") + ": " + TextOf(move, "axis");
  // Of a motor whose mechanism may hang behind, only the motor is where it is verified to be.
  const bool hangs = True(move, "reached") && TextOf(move, "cause") == "backlash";
  const std::string verified = True(move, "verified") ? "verified" : "not verified";
  line += True(move, "reached") ? hangs ? " motor at " : " at " : " NOT at its target but at ";
  line += NumberText(move, "position", 8, "") + (hangs ? " (" + verified + ")" : "") + FocusText(move);
  if (Has(move, "extensionMm")) line += ", extension " + NumberText(move, "extensionMm", 6, " mm");
  if (Has(move, "fNumber")) line += ", f/" + NumberText(move, "fNumber", 4, "");
  if (Has(move, "focalLengthMm")) {
    line += ", " + NumberText(move, "focalLengthMm", 6, " mm") + " within " +
            NumberText(move, "focalLengthBoundMm", 2, " mm");
  }
  if (Has(move, "extensionBoundUm")) {
    line += " within " + NumberText(move, "extensionBoundUm", 3, " um");
  } else if (Has(move, "positionBound") && !Has(move, "focalLengthMm")) {
    line += " within " + NumberText(move, "positionBound", 3, " steps");
  }
  if (!hangs) line += ", " + verified;
  if (Has(move, "trackingBoundUm")) {
    line += ", in focus during the whole move within " + NumberText(move, "trackingBoundUm", 3, " um");
  }
  if (Has(move, "exposureMs")) line += ", exposure now " + NumberText(move, "exposureMs", 4, " ms");
  line += " after " + TimeText(move, "elapsedMs");
  if (!TextOf(move, "reason").empty()) line += ": " + TextOf(move, "reason");
  return line;
}

std::string AutofocusProgressText(const Json& progress) {
  std::string line = "frame " + NumberText(progress, "frames", 6, "") + " of about " +
                     NumberText(progress, "framesExpected", 6, ", ") + NumberText(progress, "moves", 6, " moves") +
                     ", position " + NumberText(progress, "position", 5, "");
  if (Has(progress, "sharpness")) line += ", " + NumberText(progress, "sharpness", 3, " x as sharp as at first");
  return line;
}

std::string AutofocusStepText(const Json& step) {
  return "frame " + NumberText(step, "frame", 6, "") + " of about " + NumberText(step, "framesExpected", 6, "") +
         ", position " + NumberText(step, "position", 8, "") + FocusText(step);
}

std::string ShiftSizeText(const Json& size) {
  if (Has(size, "extensionUm")) {
    return NumberText(size, "extensionUm", 4, " um of extension, sigma ") + NumberText(size, "sigmaUm", 2, " um");
  }
  return NumberText(size, "size", 4, " steps, sigma ") + NumberText(size, "sizeSigma", 2, "");
}

/// Where it went by what was learned, or that contradicts it.
static std::string LearnedSlopeText(const Json& result) {
  if (!Has(result, "slope") || !Has(result["slope"], "known")) return "";
  const Json& known = result["slope"]["known"];
  std::string text = "\n  blur: " + NumberText(known, "factor", 3, " times the configured one, as ") +
                     NumberText(known, "runs", 3, " runs have shown");
  if (True(result["slope"], "anotherLens")) {
    text += "; it is " + NumberText(result["slope"], "shown", 3, " times now: is it another lens?");
  }
  return text;
}

std::string AutofocusText(const Json& result) {
  std::string line = TextOf(result, "lens") + ": ";
  const std::string focus = FocusText(result);
  if (TextOf(result, "cause") == "notRestored") {
    line += "NOT done" + focus;
  } else if (!True(result, "focused")) {
    line += "refused, and the lens is back where it was" + focus;
  } else {
    line += focus.empty() ? "focused" : focus.substr(2);  // ", focused at ..." says it already
  }
  line += ", position " + NumberText(result, "position", 8, "");
  if (Has(result, "sigmaD")) line += ", sigma " + NumberText(result, "sigmaD", 3, " D");
  line += ", confidence " + NumberText(result, "confidence", 3, "") + ", " +
          NumberText(result, "frames", 6, " frames, ") + NumberText(result, "moves", 6, " moves, ") +
          TimeText(result, "elapsedMs") + " by " + TextOf(result, "method");
  if (!TextOf(result, "reason").empty()) {
    line += (True(result, "focused") ? "\n  why: " : "\n  why not: ") + TextOf(result, "reason");
  }
  line += LearnedSlopeText(result);
  if (Has(result, "stars")) {
    const Json& stars = result["stars"];
    const int clipped = stars.value("clipped", 0);
    line += "\n  stars: " + NumberText(stars, "count", 4, "");
    if (clipped > 0) line += ", " + std::to_string(clipped) + " too bright for the sensor";
    if (Has(stars, "hfrPx")) line += ", half-flux radius " + NumberText(stars, "hfrPx", 3, " px");
    if (Has(stars, "fwhmPx")) line += ", FWHM " + NumberText(stars, "fwhmPx", 3, " px");
  }
  if (Has(result, "conditions") && Has(result["conditions"], "shift")) {
    line += "\n  shift: " + ShiftSizeText(result["conditions"]["shift"]);
  }
  if (Has(result, "candidates")) {
    for (const Json& candidate : result["candidates"]) {
      line += "\n  in region " + std::to_string(candidate.value("region", 0) + 1) + " at position " +
              NumberText(candidate, "position", 8, "") + FocusText(candidate);
    }
  }
  return line;
}

std::string BacklashLine(const Json& result) {
  std::string line = result.value("lens", "") + ": " + result.value("axis", "") + " backlash ";
  if (!result.value("known", false)) return line + "not measured: " + TextOf(result, "reason");
  line += NumberText(result, "size", 5, " steps");
  if (result.value("measured", false)) {
    line += ", 95 % between " + NumberText(result, "sizeLow", 5, " and ") + NumberText(result, "sizeHigh", 5, "") +
            ", by " + NumberText(result, "frames", 6, " frames");
  } else {
    line += ", as you said";
  }
  const std::string reason = TextOf(result, "reason");
  return line + (reason.empty() ? "" : "; " + reason);
}

}  // namespace lensd::cli
