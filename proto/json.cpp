#include "proto/json.h"

#include <cmath>

namespace lensd::proto {

Result<Json> ParseJson(std::string_view text) {
  bool too_deep = false;
  const Json::parser_callback_t limit_depth = [&](int depth, Json::parse_event_t event, Json&) {
    const bool opens = event == Json::parse_event_t::object_start || event == Json::parse_event_t::array_start;
    if (opens && depth >= kMaxDepth) too_deep = true;
    return !too_deep;
  };
  Json value = Json::parse(text, limit_depth, /*allow_exceptions=*/false);
  if (too_deep) return Fail(Code::Protocol, "JSON nested deeper than " + std::to_string(kMaxDepth) + " levels");
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
