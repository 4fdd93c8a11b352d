// org.varlink.service, which every Varlink service answers, and the names of its errors.
#pragma once

#include <string_view>

namespace lensd::varlink {

/// Its definition text, as GetInterfaceDescription returns it.
std::string_view ServiceInterfaceText();

inline constexpr std::string_view kInterfaceNotFound = "org.varlink.service.InterfaceNotFound";
inline constexpr std::string_view kMethodNotFound = "org.varlink.service.MethodNotFound";
inline constexpr std::string_view kMethodNotImplemented = "org.varlink.service.MethodNotImplemented";
inline constexpr std::string_view kInvalidParameter = "org.varlink.service.InvalidParameter";
inline constexpr std::string_view kPermissionDenied = "org.varlink.service.PermissionDenied";
inline constexpr std::string_view kExpectedMore = "org.varlink.service.ExpectedMore";

}  // namespace lensd::varlink
