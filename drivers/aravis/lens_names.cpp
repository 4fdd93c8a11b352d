// Tables of feature names: SFNC's own and those vendors use. The first name that a camera has is taken.
#include "lens_names.h"

namespace lensd::drivers::aravis {
namespace {

/// GenICam SFNC 2.7.1, 23.4.21 FocusStepper: "0 is the closest focus". Of the others, Allied Vision's and The Imaging
/// Source's own features, no document says which end 0 is. FocalPower grows toward near by its unit.
constexpr KnownDirection kByTheStandard{Direction::NearNegative, "the GenICam standard (SFNC)"};

// clang-format off
constexpr AxisCandidate kAxisCandidates[] = {
    // axis         feature               unit                     feedback          status                initialize               minimum            maximum
    {Axis::Focus,  "FocusStepper",        NativeUnit::Steps,       Feedback::Counts, "FocusStatus",        "FocusInitialize",       "",                "", kByTheStandard},
    {Axis::Focus,  "FocalPower",          NativeUnit::Dioptres,    Feedback::Echo,   "FocusStatus",        "FocusInitialize",       "",                ""},
    {Axis::Focus,  "EFLensFocusCurrent",  NativeUnit::Steps,       Feedback::Counts, "",                   "EFLensInitialize",      "EFLensFocusMin",  "EFLensFocusMax"},
    {Axis::Focus,  "Focus",               NativeUnit::Steps,       Feedback::None,   "",                   "",                      "",                ""},
    {Axis::Iris,   "Aperture",            NativeUnit::FNumber,     Feedback::Echo,   "ApertureStatus",     "ApertureInitialize",    "",                ""},
    {Axis::Iris,   "ApertureStepper",     NativeUnit::Steps,       Feedback::Counts, "ApertureStatus",     "ApertureInitialize",    "",                ""},
    {Axis::Iris,   "EFLensFStopCurrent",  NativeUnit::FNumber,     Feedback::Echo,   "",                   "EFLensInitialize",      "EFLensFStopMin",  "EFLensFStopMax"},
    {Axis::Iris,   "Iris",                NativeUnit::Steps,       Feedback::None,   "",                   "",                      "",                ""},
    {Axis::Zoom,   "FocalLength",         NativeUnit::Millimetres, Feedback::Echo,   "FocalLengthStatus",  "FocalLengthInitialize", "",                ""},
    {Axis::Zoom,   "FocalLengthStepper",  NativeUnit::Steps,       Feedback::Counts, "FocalLengthStatus",  "FocalLengthInitialize", "",                ""},
    {Axis::Zoom,   "EFLensZoomCurrent",   NativeUnit::Steps,       Feedback::Counts, "",                   "",                      "EFLensZoomMin",   "EFLensZoomMax"},
    {Axis::Zoom,   "Zoom",                NativeUnit::Steps,       Feedback::None,   "",                   "",                      "",                ""},
    {Axis::Filter, "Filter",              NativeUnit::Position,    Feedback::Echo,   "FilterStatus",       "FilterInitialize",      "",                ""},
};

constexpr ControllerCandidate kControllerCandidates[] = {
    // selector                  status                  initialize                  abort                  temperature                  model
    {"OpticControllerSelector", "OpticControllerStatus", "OpticControllerInitialize", "OpticControllerAbort", "OpticControllerTemperature", "OpticControllerModelName"},
    {"",                        "",                      "EFLensInitialize",          "",                     "",                           "EFLensID"},
};
// clang-format on

struct Entry {
  std::string_view name;
  Condition condition;
};
constexpr Entry kEntries[] = {
    {"Ready", Condition::Ready},
    {"NotBusy", Condition::Ready},  // Basler
    {"Busy", Condition::Busy},
    {"NotInitialized", Condition::NotInitialized},
    {"NotConnected", Condition::NotConnected},
    {"NotSupported", Condition::NotSupported},
    {"Error", Condition::Error},
};

}  // namespace

std::span<const AxisCandidate> AxisCandidates() {
  return kAxisCandidates;
}
std::span<const ControllerCandidate> ControllerCandidates() {
  return kControllerCandidates;
}

Condition ConditionOf(std::string_view entry) {
  for (const Entry& known : kEntries) {
    if (known.name == entry) return known.condition;
  }
  return Condition::Unknown;
}

std::string_view FaultOf(Condition condition) {
  switch (condition) {
    case Condition::NotConnected:
      return "no lens is connected to the camera";
    case Condition::NotSupported:
      return "the camera does not support this lens";
    case Condition::Error:
      return "the camera reports a lens error";
    default:
      return "";
  }
}

}  // namespace lensd::drivers::aravis
