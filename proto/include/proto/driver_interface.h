// The interface of a driver that is a process of its own: lensd is its client.
#pragma once

#include <string_view>

namespace lensd::proto {

/// Definition text, as GetInterfaceDescription returns it.
std::string_view DriverInterfaceText();

inline constexpr std::string_view kDriverInterface = "io.lensd.Driver";

}  // namespace lensd::proto
