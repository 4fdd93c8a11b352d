// The daemon's log: to the journal with fields to filter by when systemd runs us, to stderr otherwise. Only the daemon
// logs; everything below it returns errors.
#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace lensd::daemon {

/// What happened, as journalctl MESSAGE_ID=... finds it: 128 bits in hexadecimal.
enum class Event {
  Started,
  Reloaded,
  Stopping,
  LensReady,
  LensLost,
  CalibrationMissing,
  StateUnreadable,
  NotHomed,
  LensFailed,
  MoveFailed,
  AxisFault,
  AutofocusRefused,
  ClientDropped,
  CommandFailed,
  MotorsNotStopped,
  StateNotKept,
  NotParked,
  FailureNotTold,
  Refocused,
  SlopeForgotten,
  PartLeftOut,
  ThermometerFault,
  DriverPrinted,
  MovedExternally,
  BroughtBack
};

enum class Severity { Info, Warning, Error };

/// Chooses where the log goes. Call once, before other threads start.
void OpenLog();

/// Gives what was logged a moment to be written. At a regular exit that is done anyway.
void FlushLog();

/// What a line is about, as the journal's fields LENS= and AXIS=; empty: none in particular.
struct LogSubject {
  std::string_view lens{};
  std::string_view axis{};
};

/// How events are called in JSON: "moveFailed".
std::string_view EventName(Event event);

/// What went wrong with a lens.
struct Failure {
  Severity severity = Severity::Warning;
  Event event = Event::CommandFailed;
  std::string message, lens, axis;
};
/// From now on `told` hears of every warning and error that concerns a lens, also of those that come too often to be
/// written. It is called from any thread, and must not wait or log. Call once, before other threads start.
void OnFailure(std::function<void(Failure)> told);

/// From any thread. Never fails and never waits:
/// what no reader takes, or what comes too often, is left out and counted.
void Log(Severity severity, Event event, std::string_view message, LogSubject about = {});
inline void Log(Severity severity, Event event, std::string_view message, std::string_view lens) {
  Log(severity, event, message, LogSubject{.lens = lens});
}

}  // namespace lensd::daemon
