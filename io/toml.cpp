// toml++ behind Result, with its faults kept from it: letters beyond ASCII outside quotes and empty table headers are
// refused before it sees them. Every value keeps its file and line.
#include "io/toml.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>

#include "base/settings_problems.h"
#include "io/lenient_toml.h"

#define TOML_EXCEPTIONS 0
// toml++ 3.3 asserts, and in release builds assumes, what "[/" disproves; without that its own error branch answers.
#include <toml++/impl/preprocessor.h>
#undef TOML_ASSERT
#undef TOML_ASSERT_ASSUME
#define TOML_ASSERT(condition) static_assert(true)
#define TOML_ASSERT_ASSUME(condition) static_assert(true)
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
  if (const auto* number = node.as_floating_point()) {
    if (std::isnan(number->get())) return Fail(Code::BadData, where.Text() + ": nan is no number that is used here");
    return Settings(number->get(), where);
  }
  if (const auto* flag = node.as_boolean()) return Settings(flag->get(), where);
  return Fail(Code::BadData, where.Text() + ": dates and times are not used here");
}

constexpr int kMostKeyParts = 16;
constexpr int kMostBrackets = 32;

/// Skips the string or comment that begins at `at`, if one does: to the last of its characters.
std::size_t SkipText(std::string_view text, std::size_t at) {
  const char quote = text[at];
  if (quote == '#') return std::min(text.find('\n', at), text.size()) - 1;
  if (quote != '"' && quote != '\'') return at;
  const std::string whole(3, quote);
  const bool of_many_lines = text.substr(at, 3) == whole;
  for (std::size_t end = at + (of_many_lines ? 3 : 1); end < text.size(); ++end) {
    if (quote == '"' && text[end] == '\\') {
      ++end;
    } else if (of_many_lines ? text.substr(end, 3) == whole : text[end] == quote || text[end] == '\n') {
      return end + (of_many_lines ? 2 : 0);
    }
  }
  return text.size() - 1;
}

/// The line on which keys or values nest deeper than anything of ours does; toml++ and our own walk recurse once a
/// level. Of text that is not TOML it may name any line that is too deep.
std::optional<int> LineTooDeep(std::string_view text) {
  int line = 1, parts = 0, brackets = 0;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const std::size_t begin = at;
    at = SkipText(text, at);
    line += static_cast<int>(std::count(text.begin() + static_cast<std::ptrdiff_t>(begin),
                                        text.begin() + static_cast<std::ptrdiff_t>(at) + 1, '\n'));
    switch (text[at]) {
      case '.':
        if (++parts >= kMostKeyParts) return line;
        break;
      case '[':
      case '{':
        parts = 0;
        if (++brackets > kMostBrackets) return line;
        break;
      case ']':
      case '}':
        brackets = std::max(brackets - 1, 0);
        break;
      case '\n':
      case '=':
      case ',':
        parts = 0;
        break;
      default:
        break;
    }
  }
  return std::nullopt;
}

std::string_view Trimmed(std::string_view text) {
  const std::size_t begin = std::min(text.find_first_not_of(" \t\r"), text.size());
  return text.substr(begin, text.find_last_not_of(" \t\r") + 1 - begin);
}

std::string_view LineOf(std::string_view text, unsigned number) {
  for (; number > 1 && !text.empty(); --number) text.remove_prefix(std::min(text.find('\n'), text.size() - 1) + 1);
  return text.substr(0, text.find('\n'));
}

/// How `KEY = VALUE` is written right, where the line is no TOML since its text has no quotes, its decimals have a
/// comma or its truth has a capital. Nullopt for anything else, and for a line that is not all ASCII.
std::optional<std::string> AdviceOn(std::string_view line) {
  line = Trimmed(line.substr(0, line.find('#')));
  // A damaged file has bytes that no message may repeat.
  if (!std::ranges::all_of(line, [](char c) { return c == '\t' || (c >= ' ' && c <= '~'); })) return std::nullopt;
  const std::size_t equals = line.find('=');
  if (equals == line.npos) return std::nullopt;
  const std::string key(Trimmed(line.substr(0, equals)));
  std::string value(Trimmed(line.substr(equals + 1)));
  const auto all = [&](std::string_view characters) { return value.find_first_not_of(characters) == value.npos; };
  constexpr std::string_view kDecimal = "0123456789";
  if (value.empty() || value == "true" || value == "false") return std::nullopt;
  if (value == "True" || value == "TRUE") return "truth is written in small letters: write " + key + " = true";
  if (value == "False" || value == "FALSE") return "truth is written in small letters: write " + key + " = false";
  if (all(std::string(kDecimal) + "+-,") && std::ranges::count(value, ',') == 1) {
    value[value.find(',')] = '.';
    return "decimals stand after a point, not after a comma: write " + key + " = " + value;
  }
  const bool letters = std::ranges::any_of(value, [](char c) { return (c | 0x20) >= 'a' && (c | 0x20) <= 'z'; });
  if (!letters || value.find_first_of("\"'[]{},=") != value.npos) return std::nullopt;
  return "text stands in quotes: write " + key + " = \"" + value + "\"";
}

Result<Settings> ParseOnce(std::string_view text, const std::string& name) {
  const toml::parse_result parsed = toml::parse(text, name);
  if (parsed) return FromTable(parsed.table(), name);
  const auto& error = parsed.error();
  const std::string where = Location{name, static_cast<int>(error.source().begin.line)}.Text() + ": ";
  const bool twice = error.description().find("redefine") != std::string_view::npos;
  const auto advice = twice ? std::nullopt : AdviceOn(LineOf(text, error.source().begin.line));
  if (advice) return Fail(Code::BadData, where + *advice);
  return Fail(Code::BadData, where + std::string(error.description()));
}

}  // namespace

Result<Settings> ParseToml(std::string_view text, const std::string& name) {
  // toml++ 3.3 reaches __builtin_unreachable when it meets a letter beyond ASCII outside quotes and comments (U+00A1 to
  // U+0499, for one). So a text that has any is read once with question marks in their place, which are as illegal
  // there and as harmless inside quotes.
  const auto beyond_ascii = [](char c) { return static_cast<unsigned char>(c) >= 0x80; };
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  if (const auto line = LineTooDeep(text)) {
    return Fail(Code::BadData, Location{name, *line}.Text() + ": nested too deep");
  }
  if (std::any_of(text.begin(), text.end(), beyond_ascii)) {
    std::string ascii(text);
    std::replace_if(ascii.begin(), ascii.end(), beyond_ascii, '?');
    if (auto trial = ParseOnce(ascii, name); !trial) return trial;
  }
  return ParseOnce(text, name);
}

namespace {

Result<std::string> ReadText(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return Fail(Code::Io, path + ": " + std::strerror(errno));
  in.peek();  // fails for a folder, and merely ends for an empty file
  std::string text{std::istreambuf_iterator<char>(in), {}};
  if (in.bad()) return Fail(Code::Io, path + ": cannot be read as a file");
  return text;
}

/// The number of the line that "file:line: ..." names.
int LineIn(const Error& error, const std::string& path) {
  return std::atoi(error.message.c_str() + std::min(path.size() + 1, error.message.size()));
}

/// Makes `key = ""` of the line `key = nonsense`, or nothing of a line that was one already. False: there is no such
/// line, and what the text below it means cannot be told.
bool Empty(std::string& text, int line) {
  std::size_t begin = 0;
  for (int at = 1; at < line && begin != std::string::npos; ++at) {
    begin = text.find('\n', begin);
    if (begin != std::string::npos) ++begin;
  }
  if (begin == std::string::npos || line < 1) return false;
  const std::size_t end = std::min(text.find('\n', begin), text.size());
  const std::string old = text.substr(begin, end - begin);
  const std::size_t equals = old.find('=');
  if (equals == std::string::npos || old[old.find_first_not_of(" \t")] == '[') return false;
  const std::string emptied = old.substr(0, equals) + "= \"\"";
  text.replace(begin, end - begin, old == emptied ? "" : emptied);
  return true;
}

}  // namespace

Result<Settings> ReadTomlFile(const std::string& path) {
  auto text = ReadText(path);
  if (!text) return PassOn(text);
  return ParseToml(*text, path);
}

LenientToml ReadTomlLeniently(const std::string& path) {
  const int most_trials = SettingsProblems::Current() != nullptr ? 200 : 1;  // else only the first is told
  LenientToml read;
  auto text = ReadText(path);
  for (int trial = 0; text && trial < most_trials; ++trial) {
    auto parsed = ParseToml(*text, path);
    if (parsed) {
      read.settings = *std::move(parsed);
      return read;
    }
    const int line = LineIn(parsed.error(), path);
    if (read.faults.empty() || LineIn(read.faults.back(), path) != line) read.faults.push_back(parsed.error());
    if (!Empty(*text, line)) break;
  }
  if (!text) read.faults.push_back(text.error());
  read.whole = false;
  return read;
}

}  // namespace lensd::io
