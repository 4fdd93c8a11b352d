// A Varlink interface: its definition text, parsed, and parameters checked against it.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"
#include "varlink/json_view.h"

namespace lensd::varlink {

struct TypeDefinition;
using TypePointer = std::shared_ptr<const TypeDefinition>;
struct FieldDefinition {
  std::string name;
  TypePointer type;
};

/// One type of the definition language.
struct TypeDefinition {
  enum class Kind { Boolean, Integer, Float, String, Object, Enumeration, Struct, Array, Map, Optional, Named };
  Kind kind = Kind::Object;
  std::vector<FieldDefinition> fields;  ///< Struct
  std::vector<std::string> values;      ///< Enumeration
  TypePointer element;                  ///< Array, Map, Optional
  std::string name;                     ///< Named
};

/// Input and output of one method.
struct MethodDefinition {
  TypePointer input;   ///< a Struct
  TypePointer output;  ///< a Struct
};

/// One interface. Immutable once parsed.
class InterfaceDefinition {
 public:
  /// Code::BadData "line N: ..." where the text is not an interface of the Varlink definition language.
  static Result<InterfaceDefinition> Parse(std::string_view text);

  const std::string& name() const { return name_; }
  const std::string& text() const { return text_; }
  const std::map<std::string, MethodDefinition, std::less<>>& methods() const { return methods_; }
  const std::map<std::string, TypePointer, std::less<>>& errors() const { return errors_; }

  /// Checks an object against a Struct: unknown fields, missing fields that are not optional, wrong kinds. Returns the
  /// dotted path of the first field that is wrong, or none.
  std::optional<std::string> FirstWrong(const TypeDefinition& expected, JsonView object) const;

 private:
  friend class DefinitionParser;
  bool Matches(const TypeDefinition& expected, JsonView value, std::string& path) const;
  bool ArrayMatches(const TypeDefinition& expected, JsonView value, std::string& path) const;
  bool StructMatches(const TypeDefinition& expected, JsonView value, std::string& path) const;

  std::string text_;
  std::string name_;
  std::map<std::string, TypePointer, std::less<>> types_;
  std::map<std::string, MethodDefinition, std::less<>> methods_;
  std::map<std::string, TypePointer, std::less<>> errors_;
};

}  // namespace lensd::varlink
