#include "cli/online/target.h"

#include <string>

#include "cli/quantity.h"

namespace lensd::cli {
namespace {

using proto::Json;

Result<double> Native(std::string_view text) {
  auto number = ParseNumber(text, "TARGET");
  if (!number) return PassOn(std::move(number));
  return *number->Nearest();
}

/// A sign and a number without a unit is a count of steps; with a unit it is a vergence.
bool IsStepCount(std::string_view text) {
  return (text.starts_with('+') || text.starts_with('-')) && ParseNumber(text, "TARGET").has_value();
}

Result<Json> Field(const char* name, Result<double> value, double scale = 1.0) {
  if (!value) return PassOn(std::move(value));
  return Json{{name, *value * scale}};
}

}  // namespace

Result<Json> ParseFocusTarget(std::string_view text) {
  if (text.starts_with("near:")) return Field("nearer", Native(text.substr(5)));
  if (text.starts_with("far:")) return Field("nearer", Native(text.substr(4)), -1.0);
  if (text.starts_with('@')) return Field("native", Native(text.substr(1)));
  if (text.starts_with("ext:")) {
    auto extension = ParseLength(text.substr(4), "TARGET");
    if (!extension) return PassOn(std::move(extension));
    return Json{{"extensionMm", extension->value * 1e3}};
  }
  if (IsStepCount(text)) return Field("relative", Native(text));
  auto depth = ParseDepth(text, "TARGET");
  if (!depth) return PassOn(std::move(depth));
  return Json{{depth->IsDistance() ? "distanceM" : "vergenceD", depth->value}};
}

}  // namespace lensd::cli
