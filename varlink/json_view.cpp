// The only place that knows the parser (simdjson). Its header takes long to compile, so views keep a place in the
// parser's memory as plain numbers, and become the parser's own two-word references here.
#include "varlink/json_view.h"

#include <simdjson.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstdint>
#include <string>
#include <system_error>
#include <type_traits>

namespace lensd::varlink {
namespace {

namespace dom = simdjson::dom;
using Place = JsonView::Place;

/// Between a Place and one of the parser's references, which are a document and an index like it.
template <typename To, typename From>
To Turned(const From& from) {
  static_assert(sizeof(To) == sizeof(From) && std::is_trivially_copyable_v<To> && std::is_trivially_copyable_v<From>);
  return std::bit_cast<To>(from);
}

dom::element ElementAt(Place place) {
  return Turned<dom::element>(place);
}

bool FitsInSixtyFourBits(std::string_view integer) {
  std::int64_t with_sign = 0;
  std::uint64_t without = 0;
  const char* const end = integer.data() + integer.size();
  return std::from_chars(integer.data(), end, with_sign).ec == std::errc() ||
         std::from_chars(integer.data(), end, without).ec == std::errc();
}

/// The text with every integer of more digits than 64 bits hold written as a floating-point number, which is what it is
/// in JSON; the parser takes neither.
std::string WithLongIntegersAsFloats(std::string_view text) {
  constexpr std::string_view kNumber = "+-.0123456789Ee";
  std::string result;
  bool in_string = false;
  for (std::size_t at = 0; at < text.size();) {
    const char c = text[at];
    if (in_string || kNumber.substr(1, 12).find(c) == std::string_view::npos) {
      const std::size_t length = in_string && c == '\\' ? 2 : 1;
      in_string ^= c == '"';
      result += text.substr(at, length);
      at += length;
      continue;
    }
    const std::string_view number = text.substr(at, text.find_first_not_of(kNumber, at) - at);
    result += number;
    if (number.find_first_of(".eE") == std::string_view::npos && !FitsInSixtyFourBits(number)) result += ".0";
    at += number.size();
  }
  return result;
}

}  // namespace

struct Document::Tree {
  dom::parser parser;
  dom::element root;
};

Document::Document() : tree_(std::make_unique<Tree>()) {}
Document::Document(Document&&) noexcept = default;
Document& Document::operator=(Document&&) noexcept = default;
Document::~Document() = default;

Result<Document> Document::Parse(std::string_view text) {
  Document document;
  Tree& tree = *document.tree_;
  simdjson::error_code error = tree.parser.allocate(std::max<std::size_t>(text.size(), 1), kMaxDepth);
  if (error == simdjson::SUCCESS) error = tree.parser.parse(text.data(), text.size()).get(tree.root);
  if (error == simdjson::NUMBER_ERROR) {
    error = tree.parser.parse(WithLongIntegersAsFloats(text)).get(tree.root);
  }
  if (error == simdjson::DEPTH_ERROR) {
    return Fail(Code::Protocol, "JSON nested deeper than " + std::to_string(kMaxDepth) + " levels");
  }
  if (error != simdjson::SUCCESS) return Fail(Code::Protocol, "not valid JSON");
  return document;
}

JsonView Document::root() const {
  return JsonView(Turned<Place>(tree_->root));
}

bool JsonView::is_null() const {
  return ElementAt(place_).is_null();
}

bool JsonView::is_boolean() const {
  return ElementAt(place_).is_bool();
}

bool JsonView::is_number() const {
  return ElementAt(place_).is_number();
}

bool JsonView::is_integer() const {
  const dom::element_type type = ElementAt(place_).type();
  return type == dom::element_type::INT64;
}

bool JsonView::is_string() const {
  return ElementAt(place_).is_string();
}

bool JsonView::is_array() const {
  return ElementAt(place_).is_array();
}

bool JsonView::is_object() const {
  return ElementAt(place_).is_object();
}

bool JsonView::boolean() const {
  return ElementAt(place_).get_bool().value_unsafe();
}

double JsonView::number() const {
  return ElementAt(place_).get_double().value_unsafe();
}

std::string_view JsonView::text() const {
  return ElementAt(place_).get_string().value_unsafe();
}

JsonView::Elements JsonView::elements() const {
  const dom::array array = ElementAt(place_).get_array().value_unsafe();
  return {Turned<Place>(array.begin()), Turned<Place>(array.end())};
}

JsonView::Elements::Iterator& JsonView::Elements::Iterator::operator++() {
  place_ = Turned<Place>(++Turned<dom::array::iterator>(place_));
  return *this;
}

JsonView::Members JsonView::members() const {
  const dom::object object = ElementAt(place_).get_object().value_unsafe();
  return {Turned<Place>(object.begin()), Turned<Place>(object.end())};
}

std::pair<std::string_view, JsonView> JsonView::Members::Iterator::operator*() const {
  const auto at = Turned<dom::object::iterator>(place_);
  return {at.key(), JsonView(Turned<Place>(at.value()))};
}

JsonView::Members::Iterator& JsonView::Members::Iterator::operator++() {
  place_ = Turned<Place>(++Turned<dom::object::iterator>(place_));
  return *this;
}

std::optional<JsonView> JsonView::Find(std::string_view name) const {
  std::optional<JsonView> found;
  for (const auto& [key, value] : members()) {
    if (key == name) found = value;
  }
  return found;
}

std::optional<JsonView> JsonView::Given(std::string_view name) const {
  const std::optional<JsonView> found = Find(name);
  return found && found->is_null() ? std::nullopt : found;
}

Json JsonView::ToJson() const {
  const dom::element element = ElementAt(place_);
  switch (element.type()) {
    case dom::element_type::NULL_VALUE:
      return nullptr;
    case dom::element_type::BOOL:
      return boolean();
    case dom::element_type::STRING:
      return text();
    case dom::element_type::INT64:
      return element.get_int64().value_unsafe();
    case dom::element_type::UINT64:
      return element.get_uint64().value_unsafe();
    case dom::element_type::DOUBLE:
      return number();
    case dom::element_type::ARRAY: {
      Json array = Json::array();
      for (const JsonView value : elements()) array.push_back(value.ToJson());
      return array;
    }
    case dom::element_type::OBJECT: {
      Json object = Json::object();
      for (const auto& [name, value] : members()) object[std::string(name)] = value.ToJson();
      return object;
    }
  }
  return nullptr;
}

JsonView EmptyObject() {
  static const Document empty = *Document::Parse("{}");
  return empty.root();
}

}  // namespace lensd::varlink
