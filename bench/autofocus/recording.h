// One recorded autofocus run (`lensctl autofocus --record`) through the session again, by any method: the frame shown
// is the one taken nearest to where the method wants one.
#pragma once

#include <string>
#include <vector>

#include "autofocus/regions.h"
#include "base/result.h"
#include "drivers/api/camera.h"

namespace lensd::bench {

struct RecordedFrame {
  double at = 0.0;             ///< in the recording's unit
  bool backlash_open = false;  ///< the backlash was not taken up there
  drivers::Frame frame;
};

struct RecordedRun {
  autofocus::Setup setup;
  std::string unit;  ///< of positions: "mm" of extension, or "native"
  std::vector<drivers::Region> regions;
  autofocus::Policy policy = autofocus::Policy::Nearest;
  std::vector<RecordedFrame> frames;  ///< in the order they were taken
  bool focused = false;               ///< when it was recorded
  std::string method;                 ///< that gave the answer then
};

/// `directory`/run.json and the pictures that it names. BadData, Io.
Result<RecordedRun> LoadRun(const std::string& directory);

struct ReplayedRun {
  autofocus::Verdict verdict;
  std::string method;
  int frames = 0;
  int elsewhere = 0;  ///< of these: wanted where no frame was recorded, so the nearest one was shown
  double end = 0.0;   ///< where the lens stands then
};

/// From the first frame of the recording. InvalidArgument, Unsupported: as Session::Create().
Result<ReplayedRun> ReplayOf(const RecordedRun& run, const std::string& method);

}  // namespace lensd::bench
