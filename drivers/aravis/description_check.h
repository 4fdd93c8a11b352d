// Whether Aravis may evaluate the GenICam description of a camera.
//
// Aravis 0.8 follows the references of a description without counting: two nodes that use each other end the whole
// process, or keep a thread busy for ever. So each description is checked here before Aravis evaluates any of its
// nodes. A circle is refused where Aravis would go round it. Of Width, whose pMax depends on OffsetX, whose pMax
// depends on Width, it would not: limits depend on values, and no value depends on a limit. Such files are common.
#pragma once

#include <string_view>

#include "base/result.h"

namespace lensd::drivers::aravis {

/// `text`: the XML as the camera sent it. Pure; from any thread; takes milliseconds, a second for the largest that is
/// accepted. BadData: Aravis must not evaluate it; the message continues "its GenICam file ", and where the reason is a
/// circle names its nodes in order ("CycA -> CycB -> CycA").
Result<void> CheckDescription(std::string_view text);

}  // namespace lensd::drivers::aravis
