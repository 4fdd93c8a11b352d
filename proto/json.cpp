#include "proto/json.h"

#include <cmath>

namespace lensd::proto {

namespace {

/// Whether arrays and objects nest deeper than kMaxDepth. Of text that is not JSON it may say anything. (The parser's
/// own callback could tell, but makes every parse twice as slow.)
bool NestsTooDeep(std::string_view text) {
  int depth = 0;
  bool in_string = false;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const char c = text[at];
    if (in_string) {
      if (c == '\\') ++at;
      in_string = c != '"';
    } else if (c == '"') {
      in_string = true;
    } else if (c == '{' || c == '[') {
      if (++depth > kMaxDepth) return true;
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
  return false;
}

}  // namespace

Result<Json> ParseJson(std::string_view text) {
  if (NestsTooDeep(text)) {
    return Fail(Code::Protocol, "JSON nested deeper than " + std::to_string(kMaxDepth) + " levels");
  }
  Json value = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (value.is_discarded()) return Fail(Code::Protocol, "not valid JSON");
  return value;
}

std::string WriteJson(const Json& value) {
  return value.dump(-1, ' ', /*ensure_ascii=*/false, Json::error_handler_t::replace);
}

Json NumberOrNull(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

}  // namespace lensd::proto
