// Every error that lensd answers with (its name on the wire, its name here, what lensctl ends with), and the methods
// that drive a lens.
// Written by script/client-types from proto/io.lensd.Lens.varlink and the table of docs/interface.head.md: change that,
// not this.
#pragma once

#include <string_view>

#include "error_row.h"

namespace lensd {
inline namespace v1 {

inline constexpr ErrorRow kErrorsOfLensd[] = {
    {"io.lensd.Lens.Cancelled", "Cancelled", "stopped", 2},
    {"io.lensd.Lens.Superseded", "Superseded", "superseded", 3},
    {"io.lensd.Lens.Busy", "Busy", "busy", 4},
    {"io.lensd.Lens.Timeout", "Timeout", "timeout", 5},
    {"io.lensd.Lens.Overrun", "Overrun", "busy", 4},
    {"io.lensd.Lens.NotPermitted", "NotPermitted", "not-permitted", 77},
    {"io.lensd.Lens.OutOfRange", "OutOfRange", "out-of-range", 6},
    {"io.lensd.Lens.NotHomed", "NotHomed", "not-homed", 7},
    {"io.lensd.Lens.Unsupported", "Unsupported", "unsupported", 8},
    {"io.lensd.Lens.Leased", "Leased", "leased", 9},
    {"io.lensd.Lens.InvalidRequest", "InvalidRequest", "usage", 64},
    {"io.lensd.Lens.BadData", "BadData", "bad-data", 65},
    {"io.lensd.Lens.LensNotFound", "LensNotFound", "not-found", 68},
    {"io.lensd.Lens.PresetNotFound", "PresetNotFound", "not-found", 68},
    {"io.lensd.Lens.Disconnected", "Disconnected", "unavailable", 69},
    {"io.lensd.Lens.Internal", "Internal", "internal", 70},
    {"io.lensd.Lens.NotKept", "NotKept", "cannot-write", 73},
    {"io.lensd.Lens.BadConfiguration", "BadConfiguration", "configuration", 78},
    {"io.lensd.Lens.DeviceError", "DeviceError", "io", 74},
    {"io.lensd.Lens.ProtocolError", "ProtocolError", "protocol", 76},
    {"org.varlink.service.InvalidParameter", "InvalidParameter", "usage", 64},
    {"org.varlink.service.ExpectedMore", "ExpectedMore", "usage", 64},
    {"org.varlink.service.InterfaceNotFound", "InterfaceNotFound", "unsupported", 8},
    {"org.varlink.service.MethodNotFound", "MethodNotFound", "unsupported", 8},
    {"org.varlink.service.MethodNotImplemented", "MethodNotImplemented", "unsupported", 8},
};

inline constexpr std::string_view kDrivingMethods[] = {"Move", "Calibrate", "MeasureBacklash", "MeasureFocusShift",
    "RemoveFocusShift", "FocusAtAdd", "FocusAt", "FocusAtForget", "ForgetDrift", "ForgetLearned", "KeepDirection",
    "PresetSave", "PresetRecall", "PresetRemove", "Undo", "Home", "SetPosition", "ResetFaults", "TakeLease",
    "DropLease", "Plan", "Autofocus", "FocusMap", "AutofocusBegin", "SetExposure"};

}  // namespace v1
}  // namespace lensd
