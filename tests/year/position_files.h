// Position files as docs/moves.md has them, read with nothing of lensd's.
#pragma once

#include <optional>
#include <string>

#include "varlink/json.h"

namespace lensd::year {

/// Its axes; nothing: there is no such file. Found() where it is not whole.
std::optional<varlink::Json> ReadPositionFile(const std::string& path);

}  // namespace lensd::year
