// One line for each kind of event.
#include "cli/text/event_text.h"

#include <chrono>
#include <string_view>

#include "cli/text/texts.h"

namespace lensd::cli {
namespace {

using varlink::Json;

/// Texts of several lines are of people who asked for one thing; here each event has a line.
std::string OneLine(std::string text) {
  constexpr std::string_view kBreak = "\n  ";
  for (std::size_t at = text.find(kBreak); at != text.npos; at = text.find(kBreak))
    text.replace(at, kBreak.size(), "; ");
  return text;
}

std::string ProgressText(const Json& progress) {
  if (progress.contains("move")) {
    const Json& move = progress["move"];
    return TextOf(move, "axis") + " on its way, " + NumberText(move, "position", 8, " -> ") +
           NumberText(move, "target", 8, "");
  }
  if (progress.contains("autofocus")) return "autofocus, " + AutofocusProgressText(progress["autofocus"]);
  if (!progress.contains("backlash")) return varlink::WriteJson(progress);
  const Json& backlash = progress["backlash"];
  return "backlash, sweep " + NumberText(backlash, "sweep", 4, " of ") +
         NumberText(backlash, "sweepsExpected", 4, ", ") + NumberText(backlash, "frames", 6, " frames");
}

/// How long it lasts from now on.
std::string LastsText(const Json& lease) {
  if (lease.value("untilNs", Json()).is_null()) return " until it lets go";
  return UntilText(lease["untilNs"]);
}

std::string LeaseText(const Json& lease) {
  const std::string change = TextOf(lease, "change");
  if (change == "ended") return "lease of " + TextOf(lease, "holder") + " ended (" + TextOf(lease, "cause") + ")";
  const std::string how = change == "takenOver" ? "taken over" : change;
  return "lease " + how + " by " + TextOf(lease, "holder") + LastsText(lease);
}

std::string CalibrationChangeText(const Json& calibration) {
  std::string line = "calibration changed, now " + TextOf(calibration, "grade");
  if (!calibration.value("errorUm", Json()).is_null())
    line += " within " + NumberText(calibration, "errorUm", 3, " um");
  return line + (calibration.value("kept", true) ? "" : "; it could not be written");
}

std::string FaultText(const Json& fault) {
  const std::string what = TextOf(fault, "fault");
  return TextOf(fault, "axis") + (what.empty() ? " has no fault any more" : " FAULT: " + what);
}

std::string ThermometerText(const Json& thermometer) {
  const std::string what = TextOf(thermometer, "fault");
  return what.empty() ? "thermometer is believed again" : "thermometer FAULT: " + what;
}

std::string ListText(const Json& list) {
  const std::string change = TextOf(list, "change");
  const std::string connection = TextOf(list, "connection");
  std::string line = change == "opened" ? "there, and answers" : change;
  if (change == "gone" && !connection.empty()) line += " (" + connection + ")";
  const std::string reason = TextOf(list, "reason");
  return line + (reason.empty() ? "" : ": " + reason);
}

}  // namespace

std::string EventText(const Json& event) {
  if (event.contains("status")) return OneLine(StatusText(event["status"]));
  if (event.contains("move")) return MoveText(event["move"]);
  if (event.contains("autofocus")) return OneLine(AutofocusText(event["autofocus"]));
  if (event.contains("backlash")) return BacklashLine(event["backlash"]);
  const std::string lens = TextOf(event, "lens") + ": ";
  if (event.contains("progress")) return lens + ProgressText(event["progress"]);
  if (event.contains("fault")) return lens + FaultText(event["fault"]);
  if (event.contains("thermometer")) return lens + ThermometerText(event["thermometer"]);
  if (event.contains("lease")) return lens + LeaseText(event["lease"]);
  if (event.contains("calibration")) return lens + CalibrationChangeText(event["calibration"]);
  if (event.contains("preset")) {
    return lens + "preset \"" + TextOf(event["preset"], "label") + "\" " + TextOf(event["preset"], "change");
  }
  if (event.contains("list")) return lens + ListText(event["list"]);
  if (event.contains("refocus")) return lens + RefocusText(event["refocus"]);
  return varlink::WriteJson(event);  // of a newer daemon
}

}  // namespace lensd::cli
