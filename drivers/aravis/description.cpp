// Reads with libxml2 in the way that Aravis does: with the same function and the same handlers, so that both see the
// same elements.
#include "description.h"

#include <libxml/parser.h>

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdio>
#include <optional>

namespace lensd::drivers::aravis {
namespace {

// Cameras have some 5,000 nodes in 2 MB.
constexpr std::size_t kMostBytes = std::size_t{16} << 20;
constexpr std::size_t kMostNodes = 50'000;
constexpr std::size_t kMostElements = 500'000;
constexpr std::size_t kMostDeep = 32;  ///< elements inside of one another; files have four or five

constexpr std::array<std::string_view, 20> kNodeElements = {
    "Boolean",  "Category",     "Command",   "Converter",     "EnumEntry", "Enumeration",  "Float",
    "FloatReg", "IntConverter", "IntReg",    "IntSwissKnife", "Integer",   "MaskedIntReg", "Port",
    "Register", "String",       "StringReg", "StructEntry",   "StructReg", "SwissKnife"};
constexpr std::array<std::string_view, 8> kValueReferences = {"pAddress",      "pCommandValue", "pIndex",  "pLength",
                                                              "pValueDefault", "pValueIndexed", "pOffset", "pVariable"};
constexpr std::array<std::string_view, 6> kAsideReferences = {"pInc",      "pIsAvailable", "pIsImplemented",
                                                              "pIsLocked", "pMax",         "pMin"};

template <class Names>
bool Among(const Names& names, std::string_view name) {
  return std::ranges::find(names, name) != names.end();
}

std::string_view Trimmed(std::string_view text) {
  constexpr std::string_view kSpace = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kSpace);
  if (first == std::string_view::npos) return "";
  return text.substr(first, text.find_last_not_of(kSpace) - first + 1);
}

/// What libxml2's handlers fill.
class Reader {
 public:
  void Start(std::string_view element, const xmlChar** attributes) {
    if (elements_++ == 0) is_description_ = element == "RegisterDescription";
    if (elements_ > kMostElements) TooMuch("has more than " + std::to_string(kMostElements) + " elements");
    if (open_.size() >= kMostDeep) TooMuch("nests its elements more than " + std::to_string(kMostDeep) + " deep");
    if (problem_) return;
    Open open{.element = std::string(element), .name = "", .text = "", .node = std::nullopt};
    std::string offset;
    for (const xmlChar** next = attributes; next != nullptr && next[0] != nullptr && next[1] != nullptr; next += 2) {
      const std::string_view key = reinterpret_cast<const char*>(next[0]);
      if (key == "Name") open.name = reinterpret_cast<const char*>(next[1]);
      if (key == "pOffset") offset = reinterpret_cast<const char*>(next[1]);
    }
    if (Among(kNodeElements, element)) open.node = AddNode(element, open.name);
    if (!offset.empty()) Refer("pOffset", offset);
    open_.push_back(std::move(open));
  }

  void Characters(std::string_view text) {
    if (!problem_ && !open_.empty() && !open_.back().node) open_.back().text += text;
  }

  void End() {
    if (problem_ || open_.empty()) return;
    const Open ended = std::move(open_.back());
    open_.pop_back();
    const std::string_view text = Trimmed(ended.text);
    if (!ended.node && !text.empty()) Property(ended, text);
    if (open_.empty()) whole_ = true;  // what stands after it is no part of the description
  }

  /// libxml2 says this of lesser mistakes too; after one that it cannot read past, the outermost element has no end.
  void Mistake(std::string what) {
    if (!mistake_) mistake_ = std::move(what);
  }

  Result<Description> Take() {
    if (problem_) return Fail(Code::BadData, *problem_);
    if (!whole_) return Fail(Code::BadData, "is no valid XML" + (mistake_ ? ": " + *mistake_ : ""));
    if (!is_description_) return Fail(Code::BadData, "is no GenICam description");
    return std::move(description_);
  }

 private:
  struct Open {
    std::string element, name, text;
    std::optional<std::size_t> node;
  };

  void TooMuch(const std::string& what) {
    if (!problem_) problem_ = what + ", more than lensd accepts";
  }

  /// The node that encloses what is being read.
  DescriptionNode* Around() {
    for (auto open = open_.rbegin(); open != open_.rend(); ++open) {
      if (open->node) return &description_.nodes[*open->node];
    }
    return nullptr;
  }

  std::optional<std::size_t> AddNode(std::string_view element, const std::string& name) {
    if (description_.nodes.size() >= kMostNodes) {
      TooMuch("has more than " + std::to_string(kMostNodes) + " nodes");
      return std::nullopt;
    }
    const std::size_t added = description_.nodes.size();
    std::optional<std::size_t> around;
    if (const DescriptionNode* node = Around()) around = static_cast<std::size_t>(node - description_.nodes.data());
    DescriptionNode& node = description_.nodes.emplace_back();
    node.element = element;
    // The name of an entry is its own matter: nothing can refer to it.
    if (element != "EnumEntry") node.name = name;
    if (!around) return added;
    // An entry of a structure reads the register around it; every other node is read by the one around it.
    if (element == "StructEntry") {
      node.inside.push_back(*around);
    } else {
      description_.nodes[*around].inside.push_back(added);
    }
    return added;
  }

  void Refer(std::string_view element, std::string_view target) {
    DescriptionNode* node = Around();
    if (node == nullptr) return;
    if (element == "pValue") node->references.push_back({ReferenceKind::PValue, std::string(target)});
    if (Among(kValueReferences, element)) node->references.push_back({ReferenceKind::Value, std::string(target)});
    if (Among(kAsideReferences, element)) node->references.push_back({ReferenceKind::Aside, std::string(target)});
    if (element == "pLength") node->length_reference = target;
  }

  void Property(const Open& property, std::string_view text) {
    Refer(property.element, text);
    DescriptionNode* node = Around();
    if (node == nullptr) return;
    if (property.element == "Length") node->length = text;
    if (property.element == "Value") node->constant = text;
    if (property.element.starts_with("Formula")) node->formulas.emplace_back(text);
    if (property.element == "Expression" || property.element == "Constant") {
      node->expression_names.push_back(property.name);
      node->expressions.emplace_back(text);
    }
  }

  Description description_;
  std::vector<Open> open_;
  std::size_t elements_ = 0;
  bool is_description_ = false;
  bool whole_ = false;                  ///< the outermost element has ended
  std::optional<std::string> problem_;  ///< what lensd does not accept
  std::optional<std::string> mistake_;  ///< the first in the XML
};

Reader& Of(void* user) {
  return *static_cast<Reader*>(user);
}

/// libxml2 keeps what was wrong in its context, which it does not show here; so the message is formatted.
__attribute__((format(printf, 2, 3))) void OnError(void* user, const char* format, ...) {
  std::array<char, 200> text{};
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text.data(), text.size(), format, arguments);
  va_end(arguments);
  Of(user).Mistake(std::string(Trimmed(text.data())));
}

void OnWarning(void*, const char*, ...) {}

xmlSAXHandler Handlers() {
  xmlSAXHandler handlers{};
  handlers.startElement = +[](void* user, const xmlChar* name, const xmlChar** attributes) {
    Of(user).Start(reinterpret_cast<const char*>(name), attributes);
  };
  handlers.endElement = +[](void* user, const xmlChar*) { Of(user).End(); };
  handlers.characters = +[](void* user, const xmlChar* text, int size) {
    Of(user).Characters({reinterpret_cast<const char*>(text), static_cast<std::size_t>(size)});
  };
  handlers.warning = OnWarning;
  handlers.error = OnError;
  handlers.fatalError = OnError;
  return handlers;
}

}  // namespace

Result<Description> ReadDescription(std::string_view text) {
  if (text.size() > kMostBytes) {
    return Fail(Code::BadData, "has " + std::to_string(text.size()) + " bytes, more than lensd accepts (16 MiB)");
  }
  if (text.empty()) return Fail(Code::BadData, "is empty");
  Reader reader;
  xmlSAXHandler handlers = Handlers();
  xmlSAXUserParseMemory(&handlers, &reader, text.data(), static_cast<int>(text.size()));
  return reader.Take();
}

}  // namespace lensd::drivers::aravis
