// The interfaces themselves and the names in them that programs compare with.
#pragma once

#include <string_view>

namespace lensd::proto {

/// Definition texts, as GetInterfaceDescription returns them.
std::string_view LensInterfaceText();
std::string_view ServiceInterfaceText();

inline constexpr std::string_view kLensInterface = "io.lensd.Lens";
inline constexpr std::string_view kServiceInterface = "org.varlink.service";
inline constexpr std::string_view kDefaultSocket = "/run/lensd/io.lensd.Lens";

inline constexpr std::string_view kInterfaceNotFound = "org.varlink.service.InterfaceNotFound";
inline constexpr std::string_view kMethodNotFound = "org.varlink.service.MethodNotFound";
inline constexpr std::string_view kMethodNotImplemented = "org.varlink.service.MethodNotImplemented";
inline constexpr std::string_view kInvalidParameter = "org.varlink.service.InvalidParameter";
inline constexpr std::string_view kPermissionDenied = "org.varlink.service.PermissionDenied";
inline constexpr std::string_view kExpectedMore = "org.varlink.service.ExpectedMore";

}  // namespace lensd::proto
