// Whether Aravis may unpack the GenICam file of a camera. Most cameras keep it as a zip file.
#pragma once

#include <string_view>

#include "base/result.h"

namespace lensd::drivers::aravis {

/// `bytes`: the whole zip file. Aravis 0.8 reads and unpacks where the file says, wherever that is, so every place and
/// size that it takes from the file is checked to be inside of it. Pure; from any thread. BadData: the message
/// continues "its GenICam file ".
Result<void> CheckPackedFile(std::string_view bytes);

}  // namespace lensd::drivers::aravis
