// TOML files as Settings with file:line.
#pragma once

#include <string>
#include <string_view>

#include "base/settings.h"

namespace lensd::io {

/// Reads a TOML file. Errors: Code::Io (cannot be read), Code::BadData ("file:line: what is wrong").
Result<Settings> ReadTomlFile(const std::string& path);

/// Parses TOML text; `name` stands for the file in messages and for relative paths.
Result<Settings> ParseToml(std::string_view text, const std::string& name);

}  // namespace lensd::io
