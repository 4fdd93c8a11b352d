// The scene's faults in order of time, and which of them are in force at an instant.
#include "fault_line.h"

#include <algorithm>
#include <cmath>

namespace lensd::sim {
namespace {

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
template <class T>
void InsertByTime(std::vector<T>& list, const T& added) {
  const auto earlier = [](const T& a, const T& b) { return TimeOf(a) < TimeOf(b); };
  list.insert(std::upper_bound(list.begin(), list.end(), added, earlier), added);
}

bool IsMechanical(FaultKind kind) {
  return kind == FaultKind::Stall || kind == FaultKind::Jump || kind == FaultKind::MissedSteps;
}

}  // namespace

Duration BeginOf(const Fault& fault) {
  return FromMs(fault.at_ms);
}

Duration EndOf(const Fault& fault) {
  return fault.for_ms == 0.0 ? Duration::max() : FromMs(fault.at_ms + fault.for_ms);
}

FaultLine::FaultLine(const std::vector<Fault>& faults) {
  for (const Fault& fault : faults) InsertByTime(faults_, fault);
  for (const Fault& fault : faults_) {
    if (!IsMechanical(fault.kind)) continue;
    InsertByTime<Event>(mechanical_, {BeginOf(fault), fault, true});
    const bool ends = fault.kind != FaultKind::Jump && EndOf(fault) != Duration::max();
    if (ends) InsertByTime<Event>(mechanical_, {EndOf(fault), fault, false});
  }
}

const Fault* FaultLine::ActiveAt(FaultKind kind, Duration at, std::optional<drivers::Axis> axis) const {
  for (auto fault = faults_.rbegin(); fault != faults_.rend(); ++fault) {
    if (fault->kind != kind || (axis && fault->axis != *axis)) continue;
    if (BeginOf(*fault) <= at && at < EndOf(*fault)) return &*fault;
  }
  return nullptr;
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

}  // namespace lensd::sim
