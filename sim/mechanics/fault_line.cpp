// The scene's faults in order of time, and which of them are in force at an instant.
#include "sim/mechanics/fault_line.h"

#include <algorithm>
#include <cmath>

namespace lensd::sim {
namespace {

/// The longest exposure, twice: the camera asks for no faults before that.
constexpr Duration kRemembered = std::chrono::seconds(200);

Duration FromMs(double ms) {
  return Duration(std::llround(ms * 1e6));
}

Duration TimeOf(const Fault& fault) {
  return FromMs(fault.at_ms);
}
Duration TimeOf(const FaultLine::Event& event) {
  return event.at;
}

/// Keeps `list` in order of time, and what happens at one time in the order it came.
template <class List, class T>
void InsertByTime(List& list, const T& added) {
  const auto earlier = [](const T& a, const T& b) { return TimeOf(a) < TimeOf(b); };
  list.insert(std::upper_bound(list.begin(), list.end(), added, earlier), added);
}

/// Whether it is about the mechanism of one axis.
bool IsMechanical(FaultKind kind) {
  return kind == FaultKind::Stall || kind == FaultKind::Jump || kind == FaultKind::MissedSteps;
}

/// Whether motors notice its beginning.
bool HappensToMotors(FaultKind kind) {
  return IsMechanical(kind) || kind == FaultKind::Disconnect;
}

/// Whether it is over for good at one instant.
bool IsInstant(FaultKind kind) {
  return kind == FaultKind::Jump || kind == FaultKind::Reconnect;
}

/// Whether the coming of `next` ends `fault`.
bool Replaces(const Fault& next, const Fault& fault) {
  if (next.kind == FaultKind::Reconnect) return fault.kind == FaultKind::Disconnect;
  return next.kind == fault.kind && !IsInstant(next.kind) && (!IsOfOneAxis(next.kind) || next.axis == fault.axis);
}

}  // namespace

Duration BeginOf(const Fault& fault) {
  return FromMs(fault.at_ms);
}

Duration EndOf(const Fault& fault) {
  return fault.for_ms == 0.0 ? Duration::max() : FromMs(fault.at_ms + fault.for_ms);
}

bool IsOfOneAxis(FaultKind kind) {
  return IsMechanical(kind) || kind == FaultKind::StaleReadback;
}

FaultLine::FaultLine(const std::vector<Fault>& faults) {
  for (const Fault& fault : faults) Insert(fault);
}

void FaultLine::Insert(const Fault& fault) {
  InsertByTime(faults_, fault);
  if (!HappensToMotors(fault.kind)) return;
  InsertByTime(mechanical_, Event{BeginOf(fault), fault, true});
  const bool lasts = fault.kind == FaultKind::Stall || fault.kind == FaultKind::MissedSteps;
  const bool ends = lasts && EndOf(fault) != Duration::max();
  if (ends) InsertByTime(mechanical_, Event{EndOf(fault), fault, false});
}

/// The end that was to come does not, lest it ended what comes in its place.
void FaultLine::EndAt(Fault& fault, Duration at) {
  std::erase_if(mechanical_, [&](const Event& event) {
    return !event.begins && event.fault.kind == fault.kind && event.fault.axis == fault.axis &&
           event.at == EndOf(fault);
  });
  fault.for_ms = 1e-6 * static_cast<double>((at - BeginOf(fault)).count());
}

void FaultLine::Add(const Fault& fault) {
  const Duration now = BeginOf(fault);
  std::erase_if(faults_, [&](const Fault& past) {
    const bool replaced_at_once = Replaces(fault, past) && BeginOf(past) == now;
    const Duration over = IsInstant(past.kind) ? BeginOf(past) : EndOf(past);
    return replaced_at_once || (over <= now && now - over > kRemembered);
  });
  for (Fault& past : faults_) {
    if (Replaces(fault, past) && BeginOf(past) < now && now < EndOf(past)) EndAt(past, now);
  }
  Insert(fault);
}

std::optional<Fault> FaultLine::ActiveAt(FaultKind kind, Duration at, std::optional<drivers::Axis> axis) const {
  for (auto fault = faults_.rbegin(); fault != faults_.rend(); ++fault) {
    if (fault->kind != kind || (axis && fault->axis != *axis)) continue;
    if (BeginOf(*fault) <= at && at < EndOf(*fault)) return *fault;
  }
  return std::nullopt;
}

bool FaultLine::DisconnectedAt(Duration at) const {
  bool gone = false;
  for (const Fault& fault : faults_) {
    if (BeginOf(fault) > at) break;
    if (fault.kind == FaultKind::Disconnect) gone = at < EndOf(fault);
    if (fault.kind == FaultKind::Reconnect) gone = false;
  }
  return gone;
}

std::optional<FaultLine::Event> FaultLine::TakeDue(Duration now) {
  if (mechanical_.empty() || mechanical_.front().at > now) return std::nullopt;
  Event due = mechanical_.front();
  mechanical_.pop_front();
  return due;
}

}  // namespace lensd::sim
