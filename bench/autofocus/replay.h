// Autofocus on recorded frames: focal stacks of a real lens, each frame shown where the lens stands. The session is the
// product's own; only the lens is a list of pictures.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "autofocus/slope_learner.h"
#include "base/result.h"
#include "drivers/api/camera.h"

namespace lensd::bench {

/// A region of a stack and where it is in focus, in frames with decimals.
struct StackRegion {
  drivers::Region region;
  double best = 0.0;
  double lowest = 0.0;   ///< several depths: from here
  double highest = 0.0;  ///< to here
  std::string kind;      ///< "one depth", "several depths" or "outside" (focus is not in the stack)
};

struct Stack {
  std::string name;
  double blur_px_per_frame = 1.0;  ///< as it is told, right or wrong
  std::vector<drivers::Frame> frames;
  std::vector<StackRegion> regions;
};

/// `directory`/stacks.json, {name: {frames, blur_px_per_frame, regions: [{roi, kind, best, lowest, highest}]}}, and the
/// pictures `directory`/name/00.png, 01.png ... in order of focus. BadData, Io.
Result<std::vector<Stack>> LoadStacks(const std::string& directory, double gamma);

enum class ReplayEnd { Within, Off, False, Refused };

struct ReplayRun {
  std::string stack;
  StackRegion region;
  int start = 0;
  double end = 0.0;     ///< frame that the lens stands at
  double sigma = 0.0;   ///< claimed, in frames
  double off_px = 0.0;  ///< of blur
  int frames = 0;
  ReplayEnd how = ReplayEnd::Refused;
  std::optional<double> log_slope{};  ///< that an answer showed, over the told one
  std::optional<double> uneven{};     ///< autofocus::Verdict::uneven
  std::string method;
  std::string reason;
};

struct ReplayOptions {
  std::string method = "auto";
  int starts = 6;            ///< of each region, spread evenly
  bool crop = false;         ///< the region alone is shown instead of the whole frame
  double slope_error = 1.0;  ///< what is told of blur per frame, over what stacks.json says
  bool learn = false;        ///< what is scored goes by what the answers in the stack's other regions have shown
  double other_lens = 1.0;   ///< that was of a lens whose blur grows so many times as fast
};

/// Every region of every stack from every start. Within: at most one frame or 2 px of blur from `best` (with several
/// depths: from their span); false: more than two frames and 4 px; off: between the two.
Result<std::vector<ReplayRun>> Replay(const std::vector<Stack>& stacks, const ReplayOptions& options);

}  // namespace lensd::bench
