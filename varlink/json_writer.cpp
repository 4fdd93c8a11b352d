// JSON written straight into text. What stands before decides whether a comma is due, so nothing else is remembered.
#include "varlink/json_writer.h"

#include <array>
#include <charconv>
#include <cmath>

namespace lensd::varlink {

void JsonWriter::Separate() {
  if (text_.empty()) return;
  const char last = text_.back();
  if (last != '{' && last != '[' && last != ':') text_ += ',';
}

void JsonWriter::Quote(std::string_view text) {
  constexpr std::string_view kHex = "0123456789abcdef";
  text_ += '"';
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      text_ += '\\';
      text_ += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      text_ += "\\u00";
      text_ += kHex[static_cast<unsigned char>(c) >> 4];
      text_ += kHex[static_cast<unsigned char>(c) & 15];
    } else {
      text_ += c;
    }
  }
  text_ += '"';
}

void JsonWriter::Key(std::string_view key) {
  Separate();
  Quote(key);
  text_ += ':';
}

void JsonWriter::Begin() {
  Separate();
  text_ += '{';
}

void JsonWriter::End() {
  text_ += '}';
}

void JsonWriter::BeginArray(std::string_view key) {
  Key(key);
  text_ += '[';
}

void JsonWriter::EndArray() {
  text_ += ']';
}

void JsonWriter::BeginObject(std::string_view key) {
  Key(key);
  text_ += '{';
}

void JsonWriter::Element(std::string_view text) {
  Separate();
  Quote(text);
}

void JsonWriter::Text(std::string_view key, std::string_view text) {
  Key(key);
  Quote(text);
}

void JsonWriter::Flag(std::string_view key, bool flag) {
  Value(key, flag ? "true" : "false");
}

void JsonWriter::Number(std::string_view key, double value) {
  if (!std::isfinite(value)) return Value(key, "null");
  std::array<char, 32> digits;
  const char* const end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  const std::string_view number(digits.data(), static_cast<std::size_t>(end - digits.data()));
  Value(key, number);
  if (number.find_first_of(".e") == std::string_view::npos) text_ += ".0";  // or a reader takes it for an integer
}

void JsonWriter::Value(std::string_view key, std::string_view json) {
  Key(key);
  text_ += json;
}

}  // namespace lensd::varlink
