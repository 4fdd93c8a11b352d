// The interfaces of lensd and where they are served.
#pragma once

#include <string>
#include <string_view>

#include "varlink/service_interface.h"

namespace lensd::proto {

/// Definition texts, as GetInterfaceDescription returns them.
std::string_view LensInterfaceText();
std::string_view SimulatorInterfaceText();

inline constexpr std::string_view kLensInterface = "io.lensd.Lens";
inline constexpr std::string_view kDefaultSocket = "/run/lensd/io.lensd.Lens";
/// Of the instance NAME of lensd@.service.
inline std::string RigSocket(std::string_view name) {
  return "/run/lensd/" + std::string(name) + "/" + std::string(kLensInterface);
}

}  // namespace lensd::proto
