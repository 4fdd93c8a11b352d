// Parameters checked against a definition, so that handlers may take their presence and kind for granted. The first
// wrong field is named by its path.
#include "varlink/interface_definition.h"

#include <algorithm>

namespace lensd::varlink {
namespace {

/// Puts a field, or the place in an array ("[2]"), in front of the path of what was wrong inside it.
void Prepend(std::string& path, std::string_view field) {
  const bool joined = path.empty() || path.starts_with('[');
  path = std::string(field) + (joined ? "" : ".") + path;
}

}  // namespace

std::optional<std::string> InterfaceDefinition::FirstWrong(const TypeDefinition& expected, JsonView object) const {
  std::string path;
  if (StructMatches(expected, object, path)) return std::nullopt;
  return path;
}

bool InterfaceDefinition::Matches(const TypeDefinition& expected, JsonView value, std::string& path) const {
  using Kind = TypeDefinition::Kind;
  switch (expected.kind) {
    case Kind::Boolean:
      return value.is_boolean();
    case Kind::Integer:
      return value.is_integer();
    case Kind::Float:
      return value.is_number();
    case Kind::String:
      return value.is_string();
    case Kind::Object:
      return value.is_object();
    case Kind::Enumeration:
      return value.is_string() && std::ranges::find(expected.values, value.text()) != expected.values.end();
    case Kind::Struct:
      return StructMatches(expected, value, path);
    case Kind::Array:
      if (!value.is_array()) return false;
      return ArrayMatches(expected, value, path);
    case Kind::Map:
      if (!value.is_object()) return false;
      for (const auto& [name, member] : value.members()) {
        if (!Matches(*expected.element, member, path)) return false;
      }
      return true;
    case Kind::Optional:
      return value.is_null() || Matches(*expected.element, value, path);
    case Kind::Named:
      return Matches(*types_.find(expected.name)->second, value, path);
  }
  return false;
}

bool InterfaceDefinition::ArrayMatches(const TypeDefinition& expected, JsonView value, std::string& path) const {
  std::size_t index = 0;
  for (const JsonView element : value.elements()) {
    if (!Matches(*expected.element, element, path)) return Prepend(path, "[" + std::to_string(index) + "]"), false;
    ++index;
  }
  return true;
}

bool InterfaceDefinition::StructMatches(const TypeDefinition& expected, JsonView value, std::string& path) const {
  if (!value.is_object()) return false;
  for (const FieldDefinition& field : expected.fields) {
    const std::optional<JsonView> found = value.Find(field.name);
    const bool good = found ? Matches(*field.type, *found, path) : field.type->kind == TypeDefinition::Kind::Optional;
    if (!good) return Prepend(path, field.name), false;
  }
  std::optional<std::string_view> unknown;  // of several the first in alphabetical order
  for (const auto& [name, member] : value.members()) {
    const bool known = std::ranges::any_of(expected.fields, [&name](const auto& field) { return field.name == name; });
    if (!known && (!unknown || name < *unknown)) unknown = name;
  }
  if (!unknown) return true;
  return Prepend(path, *unknown), false;
}

}  // namespace lensd::varlink
