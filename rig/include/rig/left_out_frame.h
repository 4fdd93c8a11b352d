// A frame of an autofocus that its search was not shown.
#pragma once

#include <string>

#include "base/units.h"

namespace lensd::rig {

struct LeftOutFrame {
  int frame = 0;       ///< of the search, from 0
  Native position;     ///< of the lens
  std::string reason;  ///< "it is black where other frames are not"
};

}  // namespace lensd::rig
