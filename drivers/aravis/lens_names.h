// Names under which cameras offer their lens: the standard's (GenICam SFNC 2.7, OpticControl) and vendors' own. Data
// only.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string_view>

#include "drivers/api/lens.h"

namespace lensd::drivers::aravis {

/// One name a role may go by. Empty names: there is none.
struct AxisCandidate {
  Axis axis = Axis::Focus;
  std::string_view feature;  ///< position, read and written
  NativeUnit unit = NativeUnit::Steps;
  Feedback feedback = Feedback::Counts;
  std::string_view status;      ///< enumeration that tells the axis' state
  std::string_view initialize;  ///< command that finds the reference
  std::string_view minimum;     ///< features that hold the ends, where the position itself has no limits
  std::string_view maximum;
  std::optional<KnownDirection> direction{};  ///< of focus
};

/// What belongs to the whole lens.
struct ControllerCandidate {
  std::string_view selector;
  std::string_view status;
  std::string_view initialize;
  std::string_view abort;
  std::string_view temperature;
  std::string_view model;  ///< name of the lens
};

/// In order of preference: the first that the camera has and lets us write is taken.
std::span<const AxisCandidate> AxisCandidates();
std::span<const ControllerCandidate> ControllerCandidates();

/// What the entry of a status enumeration says.
enum class Condition { Ready, Busy, NotInitialized, NotConnected, NotSupported, Error, Unknown };
Condition ConditionOf(std::string_view entry);
/// "", or what is wrong, for people.
std::string_view FaultOf(Condition condition);

}  // namespace lensd::drivers::aravis
