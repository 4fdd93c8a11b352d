// Holding focus on a subject that may move: when to look for it anew, and when to leave the lens alone.
//
// After every search the sharpness of the next few frames is the reference. While the scene stays as it is the lens
// does not move: noise, and blur too small to matter, stay inside a dead zone. Several frames in a row outside of it
// are a change (the subject moved, or it is another scene): then the search runs again, but never sooner after the last
// one than a rate limit allows, and after refusals at longer and longer intervals, until the scene changes once more.
#pragma once

#include <optional>
#include <vector>

#include "autofocus/sharpness.h"
#include "base/clock.h"

namespace lensd::autofocus {

struct TrackerSettings {
  double dead_zone = 0.12;                                   ///< relative change of sharpness that is left alone
  Duration shortest_pause = std::chrono::milliseconds(300);  ///< from the end of a search to the next one
  Duration longest_pause = std::chrono::seconds(5);          ///< the same after many refusals
  /// Loss: sharpness that falls is a change, nothing else is; in another light the reference is taken anew.
  enum class Watches { AnyChange, Loss };
  Watches watches = Watches::AnyChange;
};

class Tracker {
 public:
  explicit Tracker(TrackerSettings settings = {}) : settings_(settings) {}

  /// A search has ended: the frames that follow are of the lens standing still.
  void SearchEnded(bool focused, Instant now);
  /// One frame of the lens standing still, `bits` a sample and `pixels` in its window. Whether to search again.
  bool Changed(const FocusScore& score, int bits, int pixels, Instant now);

 private:
  bool OutsideDeadZone(const FocusScore& score, int bits, int pixels);

  TrackerSettings settings_;
  std::vector<FocusScore> reference_;
  int outside_in_a_row_ = 0;
  bool focused_ = false;
  Instant ended_at_{};
  Duration pause_{};
};

}  // namespace lensd::autofocus
