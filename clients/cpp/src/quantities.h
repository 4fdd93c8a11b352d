// What lensctl reads, as targets and depths.
#pragma once

#include <string>

#include "lensd/types.h"

namespace lensd {
inline namespace v1 {

/// Each throws "BadText" with what would do.
Target FocusTarget(const std::string& text);
Target ApertureTarget(const std::string& text);
Target ZoomTarget(const std::string& text);

}  // namespace v1
}  // namespace lensd
