// The interfaces of lensd and where they are served.
#pragma once

#include <string_view>

#include "varlink/service_interface.h"

namespace lensd::proto {

/// Definition texts, as GetInterfaceDescription returns them.
std::string_view LensInterfaceText();
std::string_view SimulatorInterfaceText();

inline constexpr std::string_view kLensInterface = "io.lensd.Lens";
inline constexpr std::string_view kDefaultSocket = "/run/lensd/io.lensd.Lens";

}  // namespace lensd::proto
