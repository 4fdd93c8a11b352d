#include "fault_line.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace lensd::sim {
namespace {

Duration FromMs(double ms) {
  return Duration(std::llround(ms * 1e6));
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

FaultLine::FaultLine(std::vector<Fault> faults) : faults_(std::move(faults)) {
  const auto earlier = [](const Fault& a, const Fault& b) { return a.at_ms < b.at_ms; };
  std::stable_sort(faults_.begin(), faults_.end(), earlier);
  for (const Fault& fault : faults_) {
    if (!IsMechanical(fault.kind)) continue;
    mechanical_.push_back({BeginOf(fault), fault, true});
    const bool ends = fault.kind != FaultKind::Jump && EndOf(fault) != Duration::max();
    if (ends) mechanical_.push_back({EndOf(fault), fault, false});
  }
  std::stable_sort(mechanical_.begin(), mechanical_.end(), [](const Event& a, const Event& b) { return a.at < b.at; });
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
