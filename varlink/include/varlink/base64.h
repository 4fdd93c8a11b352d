// Bytes as text and back: how pictures travel in JSON.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace lensd::varlink {

/// RFC 4648 base64 with padding.
std::string EncodeBase64(std::span<const std::uint8_t> bytes);
/// Its inverse. Code::Protocol: a character that is not base64, or padding anywhere but at the end.
Result<std::vector<std::uint8_t>> DecodeBase64(std::string_view text);

}  // namespace lensd::varlink
