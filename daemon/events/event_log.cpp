// Moves that missed, searches that were refused, faults that came and went: one line each, with the lens and the axis
// as fields to filter by.
#include "daemon/events/event_log.h"

#include <string>

#include "daemon/events/log.h"

namespace lensd::daemon {
namespace {

using varlink::Json;

std::string TextAt(const Json& event, const char* key) {
  const auto found = event.find(key);
  return found != event.end() && found->is_string() ? found->get<std::string>() : "";
}

void LogMove(std::string_view lens, const Json& move) {
  if (move.value("reached", false)) return;
  const std::string axis = TextAt(move, "axis");
  const auto position = move.find("position");
  const std::string where =
      position != move.end() && position->is_number() ? "stands at " + position->dump() : "its position is not known";
  Log(Severity::Warning, Event::MoveFailed,
      axis + " did not get to its target (" + TextAt(move, "cause") + "): " + TextAt(move, "reason") + "; " + where,
      {.lens = lens, .axis = axis});
}

void LogFault(std::string_view lens, const Json& fault) {
  const std::string axis = TextAt(fault, "axis");
  const std::string what = TextAt(fault, "fault");
  if (what.empty()) {
    return Log(Severity::Info, Event::AxisFault, axis + " has no fault any more", {.lens = lens, .axis = axis});
  }
  Log(Severity::Warning, Event::AxisFault, axis + " has a fault: " + what, {.lens = lens, .axis = axis});
}

void LogThermometer(std::string_view lens, const Json& thermometer) {
  const std::string what = TextAt(thermometer, "fault");
  if (what.empty()) return Log(Severity::Info, Event::ThermometerFault, "its thermometer is believed again", lens);
  Log(Severity::Warning, Event::ThermometerFault, "its thermometer is not believed: " + what, lens);
}

/// A search that was refused has been told of as one.
void LogRefocus(std::string_view lens, const Json& refocus) {
  const std::string end = TextAt(refocus, "end");
  Log(end == "failed" ? Severity::Warning : Severity::Info, Event::Refocused,
      "refocus by " + TextAt(refocus, "cause") + ", " + end + ": " + TextAt(refocus, "reason"),
      {.lens = lens, .axis = "focus"});
}

}  // namespace

void LogResult(std::string_view lens, std::string_view field, const Json& event) {
  if (field == "move") return LogMove(lens, event);
  if (field == "fault") return LogFault(lens, event);
  if (field == "thermometer") return LogThermometer(lens, event);
  if (field == "refocus") return LogRefocus(lens, event);
  if (field == "autofocus" && !event.value("focused", false)) {
    Log(Severity::Warning, Event::AutofocusRefused,
        "autofocus was refused (" + TextAt(event, "cause") + "): " + TextAt(event, "reason"),
        {.lens = lens, .axis = "focus"});
  }
}

void LogFailedCall(std::string_view lens, std::string_view axis, std::string_view method, const Error& error) {
  switch (error.code) {
    case Code::Timeout:
    case Code::Protocol:
    case Code::Io:
    case Code::NotKept:
    case Code::Internal:
      return Log(Severity::Warning, Event::CommandFailed, std::string(method) + ": " + error.message,
                 {.lens = lens, .axis = axis});
    default:
      return;
  }
}

}  // namespace lensd::daemon
