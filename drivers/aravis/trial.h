// Opening a camera on USB for the first time in a process of its own, where it may crash or never end without harm.
//
// Aravis 0.8 reads and unpacks the GenICam file of a USB3 Vision camera as it opens the device, so that nobody can look
// at the file before: it takes the size that the camera states, and its unpacking believes every number in a zip file.
// Over GigE Vision lensd fetches the file itself first (packed_file.h).
#pragma once

#include <string>
#include <vector>

#include "base/clock.h"
#include "base/result.h"

namespace lensd::drivers::aravis {

/// Runs a program, by its path, with its arguments, and waits for its end, `limit` at most; then it is killed. What it
/// writes is dropped. From any thread. Unsupported: it crashed, failed or was killed; the message continues "the
/// process that tried it ". Io: it could not be started.
Result<void> RunTrial(const std::vector<std::string>& command, Duration limit);

/// As TryUsbCamerasBy() says, RunTrial() of opening the camera with that id of Aravis'. Nothing where no program is
/// set.
Result<void> TryUsbCameraFirst(const std::string& id);

}  // namespace lensd::drivers::aravis
