#include "io/toml.h"

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

}  // namespace

Result<Settings> ParseToml(std::string_view text, const std::string& name) {
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
