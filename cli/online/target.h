// Where an axis should go, as people write it.
#pragma once

#include <string_view>

#include "base/result.h"
#include "proto/json.h"

namespace lensd::cli {

/// The interface's Target for focus: a distance or vergence, `+N` or `-N` native steps, `near:N` or `far:N` steps
/// nearer or farther, `@N` an absolute native position, `ext:2.6mm` an extension. Code::InvalidArgument.
Result<proto::Json> ParseFocusTarget(std::string_view text);

}  // namespace lensd::cli
