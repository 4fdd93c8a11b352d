// JSON as it goes over the wire: parsed within limits, written without surprises.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "base/result.h"

namespace lensd::varlink {

using Json = nlohmann::json;

/// Deepest nesting of arrays and objects accepted. Deeper documents parse, but overflow the stack when written.
inline constexpr int kMaxDepth = 64;

/// Parses one JSON value. Code::Protocol: not JSON, not UTF-8, a number beyond double, or deeper than kMaxDepth.
Result<Json> ParseJson(std::string_view text);

/// Writes on one line. Bytes that are not UTF-8 (names told by devices) become U+FFFD. Doubles read back to the same
/// value; numbers that are not finite must have gone through NumberOrNull() before.
std::string WriteJson(const Json& value);

/// The number, or null where it is not finite: JSON has neither NaN nor infinity.
Json NumberOrNull(double value);

}  // namespace lensd::varlink
