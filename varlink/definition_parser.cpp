// Reads the Varlink interface definition language by recursive descent: one function per rule of the grammar. Errors
// are kept in one place and everything unwinds; nesting is limited as JSON's is.
#include <cctype>

#include "varlink/interface_definition.h"

namespace lensd::varlink {

class DefinitionParser {
 public:
  explicit DefinitionParser(std::string_view text) : text_(text) {}

  Result<InterfaceDefinition> Run() {
    if (Word() != "interface") return Fail(Code::BadData, Where() + "expected \"interface\"");
    result_.text_ = text_;
    result_.name_ = InterfaceName();
    for (SkipBlank(); error_.empty() && at_ < text_.size(); SkipBlank()) Member();
    if (error_.empty()) CheckNamed();
    if (!error_.empty()) return Fail(Code::BadData, error_);
    return std::move(result_);
  }

 private:
  using Kind = TypeDefinition::Kind;

  std::string Where() const {
    std::size_t line = 1;
    for (std::size_t i = 0; i < at_ && i < text_.size(); ++i) line += text_[i] == '\n';
    return "line " + std::to_string(line) + ": ";
  }
  void Reject(const std::string& why) {
    if (error_.empty()) error_ = Where() + why;
    at_ = text_.size();
  }
  void SkipBlank() {
    while (at_ < text_.size()) {
      if (text_[at_] == '#') {
        at_ = std::min(text_.find('\n', at_), text_.size());
      } else if (std::isspace(static_cast<unsigned char>(text_[at_]))) {
        ++at_;
      } else {
        return;
      }
    }
  }
  bool Take(std::string_view token) {
    SkipBlank();
    if (!text_.substr(at_).starts_with(token)) return false;
    at_ += token.size();
    return true;
  }
  void Expect(std::string_view token) {
    if (!Take(token)) Reject("expected \"" + std::string(token) + "\"");
  }
  std::string Word(std::string_view extra = "_") {
    SkipBlank();
    const std::size_t start = at_;
    while (at_ < text_.size() &&
           (std::isalnum(static_cast<unsigned char>(text_[at_])) || extra.find(text_[at_]) != extra.npos)) {
      ++at_;
    }
    return std::string(text_.substr(start, at_ - start));
  }
  std::string InterfaceName() {
    std::string name = Word(".-");
    if (name.find('.') == std::string::npos) Reject("an interface name has at least two parts");
    return name;
  }
  std::string TypeName() {
    std::string name = Word("");
    if (name.empty() || !std::isupper(static_cast<unsigned char>(name[0]))) {
      Reject("a type, method or error name starts with a capital letter");
    }
    return name;
  }
  std::string FieldName() {
    std::string name = Word();
    const bool good = !name.empty() && std::isalpha(static_cast<unsigned char>(name[0])) && name.back() != '_' &&
                      name.find("__") == std::string::npos;
    if (!good) Reject("a field name starts with a letter and has single underscores inside");
    return name;
  }

  void Member() {
    const std::string keyword = Word();
    if (keyword == "type") {
      const std::string name = TypeName();
      Add(result_.types_, name, StructOrEnumeration());
    } else if (keyword == "method") {
      const std::string name = TypeName();
      MethodDefinition method{StructOrEnumeration(), nullptr};
      Expect("->");
      method.output = StructOrEnumeration();
      Add(result_.methods_, name, std::move(method));
    } else if (keyword == "error") {
      const std::string name = TypeName();
      Add(result_.errors_, name, StructOrEnumeration());
    } else {
      Reject("expected \"type\", \"method\" or \"error\"");
    }
  }
  template <class Map, class Value>
  void Add(Map& map, const std::string& name, Value value) {
    if (error_.empty() && !map.emplace(name, std::move(value)).second) Reject(name + " is defined twice");
  }

  TypePointer StructOrEnumeration() {
    auto type = std::make_shared<TypeDefinition>();
    type->kind = Kind::Struct;
    Expect("(");
    if (Take(")")) return type;
    bool enumeration = false;
    do {
      std::string name = FieldName();
      const bool typed = Take(":");
      if (type->fields.empty() && type->values.empty()) enumeration = !typed;
      if (enumeration == typed) Reject("fields have types, values of an enumeration have none");
      if (typed) {
        type->fields.push_back({std::move(name), Type()});
      } else {
        type->values.push_back(std::move(name));
      }
    } while (error_.empty() && Take(","));
    Expect(")");
    if (enumeration) type->kind = Kind::Enumeration;
    return type;
  }
  TypePointer Type() {
    if (++depth_ > kMaxDepth) Reject("types nested too deep");
    SkipBlank();
    TypePointer type = error_.empty() && at_ < text_.size() && text_[at_] == '(' ? StructOrEnumeration() : Wrapped();
    --depth_;
    return type;
  }
  TypePointer Wrapped() {
    auto type = std::make_shared<TypeDefinition>();
    if (!error_.empty()) return type;
    if (Take("?")) {
      type->kind = Kind::Optional;
    } else if (Take("[]")) {
      type->kind = Kind::Array;
    } else if (Take("[string]")) {
      type->kind = Kind::Map;
    } else {
      Plain(*type);
      return type;
    }
    type->element = Type();
    return type;
  }
  void Plain(TypeDefinition& type) {
    const std::string word = Word("");
    if (word == "bool")
      type.kind = Kind::Boolean;
    else if (word == "int")
      type.kind = Kind::Integer;
    else if (word == "float")
      type.kind = Kind::Float;
    else if (word == "string")
      type.kind = Kind::String;
    else if (word == "object")
      type.kind = Kind::Object;
    else if (!word.empty() && std::isupper(static_cast<unsigned char>(word[0]))) {
      type.kind = Kind::Named;
      type.name = word;
      named_.emplace_back(word, at_);
    } else {
      Reject("\"" + word + "\" is not a type");
    }
  }
  void CheckNamed() {
    for (const auto& [name, used_at] : named_) {
      if (result_.types_.contains(name)) continue;
      at_ = used_at;
      return Reject("the type " + name + " is used and not defined");
    }
  }

  std::string_view text_;
  std::size_t at_ = 0;
  int depth_ = 0;
  std::string error_;
  std::vector<std::pair<std::string, std::size_t>> named_;  // where each is used
  InterfaceDefinition result_;
};

Result<InterfaceDefinition> InterfaceDefinition::Parse(std::string_view text) {
  return DefinitionParser(text).Run();
}

}  // namespace lensd::varlink
