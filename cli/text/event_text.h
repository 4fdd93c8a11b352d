// What Monitor tells, for people.
#pragma once

#include <string>

#include "varlink/json.h"

namespace lensd::cli {

/// One line of Event.
std::string EventText(const varlink::Json& event);

}  // namespace lensd::cli
