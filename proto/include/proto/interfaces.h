// The interface io.lensd.Lens and where it is served.
#pragma once

#include <string_view>

#include "varlink/service_interface.h"

namespace lensd::proto {

/// Its definition text, as GetInterfaceDescription returns it.
std::string_view LensInterfaceText();

inline constexpr std::string_view kLensInterface = "io.lensd.Lens";
inline constexpr std::string_view kDefaultSocket = "/run/lensd/io.lensd.Lens";

}  // namespace lensd::proto
