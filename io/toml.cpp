#include "io/toml.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#define TOML_EXCEPTIONS 0
#include <toml++/toml.h>

namespace lensd::io {
namespace {

Result<Settings> FromNode(const toml::node& node, const std::string& file);

Result<Settings> FromTable(const toml::table& table, const std::string& file) {
  Settings::Table values;
  for (const auto& [key, child] : table) {
    auto value = FromNode(child, file);
    if (!value) return value;
    values.emplace(std::string(key.str()), std::move(*value));
  }
  return Settings(std::move(values), {file, static_cast<int>(table.source().begin.line)});
}

Result<Settings> FromNode(const toml::node& node, const std::string& file) {
  const Location where{file, static_cast<int>(node.source().begin.line)};
  if (const auto* table = node.as_table()) return FromTable(*table, file);
  if (const auto* array = node.as_array()) {
    Settings::Array values;
    for (const auto& child : *array) {
      auto value = FromNode(child, file);
      if (!value) return value;
      values.push_back(std::move(*value));
    }
    return Settings(std::move(values), where);
  }
  if (const auto* text = node.as_string()) return Settings(text->get(), where);
  if (const auto* integer = node.as_integer()) return Settings(integer->get(), where);
  if (const auto* number = node.as_floating_point()) return Settings(number->get(), where);
  if (const auto* flag = node.as_boolean()) return Settings(flag->get(), where);
  return Fail(Code::BadData, where.Text() + ": dates and times are not used here");
}

// The line of the first byte above ASCII outside strings and comments, or 0. toml++ 3.3 runs into __builtin_unreachable
// while deciding whether such a character is white space (U+00A1 to U+0499, for one), and TOML 1.0 has no use for them
// there.
int LineOfStrayCharacter(std::string_view text) {
  int line = 1;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const char c = text[at];
    if (c == '\n') {
      ++line;
    } else if (c == '#') {
      at = std::min(text.find('\n', at), text.size()) - 1;
    } else if (c == '"' || c == '\'') {
      const bool long_string = text.substr(at, 3) == std::string(3, c);
      const std::string_view quote = text.substr(at, long_string ? 3 : 1);
      for (at += quote.size(); at < text.size() && text.substr(at, quote.size()) != quote; ++at) {
        if (text[at] == '\\' && c == '"') ++at;
        if (at < text.size() && text[at] == '\n') {
          ++line;
          if (!long_string) break;  // unterminated: the parser says so
        }
      }
      at += quote.size() - 1;
    } else if (static_cast<unsigned char>(c) >= 0x80) {
      return line;
    }
  }
  return 0;
}

}  // namespace

Result<Settings> ParseToml(std::string_view text, const std::string& name) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  if (const int line = LineOfStrayCharacter(text); line > 0) {
    return Fail(Code::BadData, Location{name, line}.Text() + ": letters beyond ASCII belong in quotes");
  }
  const toml::parse_result parsed = toml::parse(text, name);
  if (!parsed) {
    const auto& error = parsed.error();
    return Fail(Code::BadData, Location{name, static_cast<int>(error.source().begin.line)}.Text() + ": " +
                                   std::string(error.description()));
  }
  return FromTable(parsed.table(), name);
}

Result<Settings> ReadTomlFile(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return Fail(Code::Io, path + ": " + std::strerror(errno));
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  if (in.bad() || (text.empty() && !in.eof())) return Fail(Code::Io, path + ": cannot be read as a file");
  return ParseToml(text, path);
}

}  // namespace lensd::io
