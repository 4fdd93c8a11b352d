// Targets as people write them, into the fields of a Move. What they mean is for the daemon to say.
#include "cli/link/target.h"

#include <string>

#include "cli/text/quantity.h"

namespace lensd::cli {
namespace {

using varlink::Json;

Result<double> Native(std::string_view text, std::string_view option) {
  auto number = ParseNumber(text, option);
  if (!number) return PassOn(number);
  return *number->Nearest();
}

Result<Json> Field(const char* name, Result<double> value, double scale = 1.0) {
  if (!value) return PassOn(value);
  return Json{{name, *value * scale}};
}

}  // namespace

Result<std::optional<Json>> ParseStepTarget(std::string_view text, std::string_view option) {
  const bool absolute = text.starts_with('@');
  // A sign and a number without a unit is a count of steps; with a unit it is a vergence.
  const bool relative = (text.starts_with('+') || text.starts_with('-')) && ParseNumber(text, option);
  if (!absolute && !relative) return std::nullopt;
  if (text == "@") {
    return Fail(Code::InvalidArgument, std::string(option) + " '@': the position is missing, as in @1200");
  }
  auto number = Native(absolute ? text.substr(1) : text, option);
  if (!number) return PassOn(number);
  return Json{{absolute ? "position" : "relative", *number}};
}

Result<Json> ParseFocusTarget(std::string_view text, std::string_view option) {
  if (text.starts_with("near:")) return Field("nearer", Native(text.substr(5), option));
  if (text.starts_with("far:")) return Field("nearer", Native(text.substr(4), option), -1.0);
  auto steps = ParseStepTarget(text, option);
  if (!steps) return PassOn(steps);
  if (*steps) return **std::move(steps);
  if (text.starts_with("ext:")) {
    auto extension = ParseLength(text.substr(4), option);
    if (!extension) return PassOn(extension);
    return Json{{"extensionMm", extension->value * 1e3}};
  }
  if (ParseNumber(text, option)) {
    const std::string number(text);
    return Fail(Code::InvalidArgument, std::string(option) + " '" + number + "': a bare number; write " + number +
                                           "m or " + number + "mm for a distance, " + number + "D for a vergence, @" +
                                           number + " for this position of the motor, or +" + number +
                                           " to move by so many steps");
  }
  auto depth = ParseDepth(text, option);
  if (!depth) return PassOn(depth);
  if (depth->IsDistance() && text.find_first_of("+-") == 0) {
    return Fail(Code::InvalidArgument,
                std::string(option) + " '" + std::string(text) +
                    "': a distance has no sign; +N, -N, near:N and far:N move by N steps, ext:2.6mm is an extension");
  }
  return Json{{depth->IsDistance() ? "distanceM" : "vergenceD", depth->value}};
}

}  // namespace lensd::cli
