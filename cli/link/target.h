// Where an axis should go, as people write it.
#pragma once

#include <optional>
#include <string_view>

#include "base/result.h"
#include "varlink/json.h"

namespace lensd::cli {

/// The interface's Target for `@N`, an absolute native position, and `+N` or `-N` native steps; nothing: `text` is
/// something else. Code::InvalidArgument: `@` without a number. `option` names it in messages.
Result<std::optional<varlink::Json>> ParseStepTarget(std::string_view text, std::string_view option);

/// The interface's Target for focus: a distance or vergence, `+N` or `-N` native steps, `near:N` or `far:N` steps
/// nearer or farther, `@N` an absolute native position, `ext:2.6mm` an extension. Code::InvalidArgument names `option`.
Result<varlink::Json> ParseFocusTarget(std::string_view text, std::string_view option = "TARGET");

}  // namespace lensd::cli
