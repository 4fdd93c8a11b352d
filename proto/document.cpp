#include "proto/document.h"

#include <algorithm>
#include <string>

namespace lensd::proto {
namespace {

/// Whether arrays and objects nest deeper than kMaxDepth. Of text that is not JSON it may say anything. (Parsers tell
/// only once they are there.)
bool NestsTooDeep(std::string_view text) {
  int depth = 0;
  bool in_string = false;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const char c = text[at];
    if (in_string) {
      if (c == '\\') ++at;
      in_string = c != '"';
    } else if (c == '"') {
      in_string = true;
    } else if (c == '{' || c == '[') {
      if (++depth > kMaxDepth) return true;
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
  return false;
}

/// Memory is taken from the heap in pieces of this size: a call is one piece.
constexpr std::size_t kPiece = 4096;
constexpr std::size_t kStack = 512;

}  // namespace

struct Document::Tree {
  std::string text;  ///< strings of the document are parts of it
  rapidjson::MemoryPoolAllocator<> pool{kPiece};
  rapidjson::Document document{&pool, kStack};
};

Document::Document() : tree_(std::make_unique<Tree>()) {}
Document::Document(Document&&) noexcept = default;
Document& Document::operator=(Document&&) noexcept = default;
Document::~Document() = default;

Result<Document> Document::Parse(std::string_view text) {
  if (NestsTooDeep(text)) {
    return Fail(Code::Protocol, "JSON nested deeper than " + std::to_string(kMaxDepth) + " levels");
  }
  Document document;
  Tree& tree = *document.tree_;
  tree.text = text;
  tree.text.append(4, '\0');  // a character cut short is read to its full length before it is refused
  constexpr unsigned kFlags = rapidjson::kParseFullPrecisionFlag | rapidjson::kParseInsituFlag;
  const bool ascii = std::ranges::all_of(text, [](char c) { return static_cast<signed char>(c) >= 0; });
  if (ascii) {
    tree.document.ParseInsitu<kFlags>(tree.text.data());
  } else {
    tree.document.ParseInsitu<kFlags | rapidjson::kParseValidateEncodingFlag>(tree.text.data());
  }
  // A NUL would end the text for the parser.
  const bool whole = text.find('\0') == std::string_view::npos;
  if (!whole || tree.document.HasParseError()) return Fail(Code::Protocol, "not valid JSON");
  return document;
}

JsonView Document::root() const {
  return JsonView(tree_->document);
}

std::optional<JsonView> JsonView::Find(std::string_view name) const {
  for (std::size_t i = member_count(); i > 0; --i) {
    if (member_name(i - 1) == name) return member(i - 1);
  }
  return std::nullopt;
}

std::optional<JsonView> JsonView::Given(std::string_view name) const {
  const std::optional<JsonView> found = Find(name);
  return found && found->is_null() ? std::nullopt : found;
}

Json JsonView::ToJson() const {
  switch (value_->GetType()) {
    case rapidjson::kNullType:
      return nullptr;
    case rapidjson::kFalseType:
    case rapidjson::kTrueType:
      return boolean();
    case rapidjson::kStringType:
      return text();
    case rapidjson::kNumberType:
      if (value_->IsInt64()) return value_->GetInt64();
      if (value_->IsUint64()) return value_->GetUint64();
      return number();
    case rapidjson::kArrayType: {
      Json array = Json::array();
      for (std::size_t i = 0; i < size(); ++i) array.push_back((*this)[i].ToJson());
      return array;
    }
    case rapidjson::kObjectType: {
      Json object = Json::object();
      for (std::size_t i = 0; i < member_count(); ++i) object[std::string(member_name(i))] = member(i).ToJson();
      return object;
    }
  }
  return nullptr;
}

JsonView EmptyObject() {
  static const rapidjson::Value empty(rapidjson::kObjectType);
  return JsonView(empty);
}

}  // namespace lensd::proto
