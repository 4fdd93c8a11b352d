// Each field of a Target is a kind of the rig's.
#include "daemon/wire/target_json.h"

#include <algorithm>
#include <array>

#include "daemon/wire/lens_json.h"
#include "daemon/wire/refusal.h"

namespace lensd::daemon {
namespace {

struct TargetField {
  std::string_view name;
  rig::Target::Kind kind;
  double scale;  // from the unit in the name to the rig's
};
constexpr std::array kTargetFields = {
    TargetField{"distanceM", rig::Target::Kind::Distance, 1.0},
    TargetField{"vergenceD", rig::Target::Kind::Vergence, 1.0},
    TargetField{"extensionMm", rig::Target::Kind::Extension, 1e-3},
    TargetField{"fNumber", rig::Target::Kind::FNumber, 1.0},
    TargetField{"focalLengthMm", rig::Target::Kind::FocalLength, 1e-3},
    TargetField{"position", rig::Target::Kind::Native, 1.0},
    TargetField{"relative", rig::Target::Kind::NativeRelative, 1.0},
    TargetField{"nearer", rig::Target::Kind::TowardNear, 1.0},
};

}  // namespace

std::string TargetPath(const std::string& path, const varlink::Json& target) {
  const auto* const field =
      std::ranges::find_if(kTargetFields, [&](const TargetField& each) { return Given(target, each.name) != nullptr; });
  return field == kTargetFields.end() ? path : path + "." + std::string(field->name);
}

Result<rig::Target> TargetOf(const varlink::Json& target, std::optional<optics::DistanceFrom> from,
                             const std::string& path) {
  std::optional<rig::Target> found;
  for (const TargetField& field : kTargetFields) {
    const varlink::Json* value = Given(target, field.name);
    if (value == nullptr) continue;
    if (found) return PassOn(Wrong("a target has exactly one field", {.parameter = path}));
    found = rig::Target{field.kind, value->get<double>() * field.scale, from};
  }
  if (!found) return PassOn(Wrong("a target has exactly one field", {.parameter = path}));
  return *found;
}

}  // namespace lensd::daemon
