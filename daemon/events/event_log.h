// What goes wrong with a lens, as lines of the log.
#pragma once

#include <string_view>

#include "base/result.h"
#include "varlink/json.h"

namespace lensd::daemon {

/// A result or a change that Monitor tells of (`field` of Event): logs it where something failed, or is well again.
/// What went well is not logged. From the event loop's thread.
void LogResult(std::string_view lens, std::string_view field, const varlink::Json& event);

/// A call that the device or lensd failed, not its caller. A lens that is gone has been logged as lost.
void LogFailedCall(std::string_view lens, std::string_view axis, std::string_view method, const Error& error);

}  // namespace lensd::daemon
