#include "proto/interface_definition.h"

#include <algorithm>

namespace lensd::proto {
namespace {

/// Puts a field in front of the path of what was wrong inside it.
void Prepend(std::string& path, std::string_view field) {
  path = path.empty() ? std::string(field) : std::string(field) + "." + path;
}

}  // namespace

std::optional<std::string> InterfaceDefinition::FirstWrong(const TypeDefinition& expected, const Json& object) const {
  std::string path;
  if (StructMatches(expected, object, path)) return std::nullopt;
  return path;
}

bool InterfaceDefinition::Matches(const TypeDefinition& expected, const Json& value, std::string& path) const {
  using Kind = TypeDefinition::Kind;
  const auto element_matches = [&](const Json& element) { return Matches(*expected.element, element, path); };
  switch (expected.kind) {
    case Kind::Boolean:
      return value.is_boolean();
    case Kind::Integer:
      return value.is_number_integer();
    case Kind::Float:
      return value.is_number();
    case Kind::String:
      return value.is_string();
    case Kind::Object:
      return value.is_object();
    case Kind::Enumeration:
      return value.is_string() &&
             std::ranges::find(expected.values, value.get_ref<const std::string&>()) != expected.values.end();
    case Kind::Struct:
      return StructMatches(expected, value, path);
    case Kind::Array:
      return value.is_array() && std::all_of(value.begin(), value.end(), element_matches);
    case Kind::Map:
      return value.is_object() && std::all_of(value.begin(), value.end(), element_matches);
    case Kind::Optional:
      return value.is_null() || Matches(*expected.element, value, path);
    case Kind::Named:
      return Matches(*types_.find(expected.name)->second, value, path);
  }
  return false;
}

bool InterfaceDefinition::StructMatches(const TypeDefinition& expected, const Json& value, std::string& path) const {
  if (!value.is_object()) return false;
  std::size_t present = 0;
  for (const FieldDefinition& field : expected.fields) {
    const auto found = value.find(field.name);
    const bool here = found != value.end();
    present += here;
    const bool good = here ? Matches(*field.type, *found, path) : field.type->kind == TypeDefinition::Kind::Optional;
    if (!good) return Prepend(path, field.name), false;
  }
  if (present == value.size()) return true;
  for (const auto& [name, unused] : value.items()) {
    const bool known = std::ranges::any_of(expected.fields, [&](const auto& field) { return field.name == name; });
    if (!known) return Prepend(path, name), false;
  }
  return true;
}

}  // namespace lensd::proto
