// JSON values as trees, for answers that are built piece by piece. Parsing goes through the checked parser of
// json_view.cpp.
#include "varlink/json.h"

#include <cmath>

#include "varlink/json_view.h"

namespace lensd::varlink {

Result<Json> ParseJson(std::string_view text) {
  const Result<Document> document = Document::Parse(text);
  if (!document) return PassOn(document);
  return document->root().ToJson();
}

std::string WriteJson(const Json& value) {
  return value.dump(-1, ' ', /*ensure_ascii=*/false, Json::error_handler_t::replace);
}

Json NumberOrNull(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

}  // namespace lensd::varlink
