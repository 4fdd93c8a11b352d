// By how many frames the picture of a camera is late: the frames that are taken where the lens has come to and show
// where it was. It is learned by one frame more after a long move that shows, since two frames that agree there are
// both of the place; frames that do not agree are followed by others until two do, and those that changed count. From
// then on so many frames are thrown away after each move, which shows anew what the lag is.
#pragma once

#include <optional>
#include <vector>

#include "autofocus/measures.h"
#include "drivers/api/camera.h"

namespace lensd::autofocus {

/// More than so many frames are no lag that a search could live with.
inline constexpr int kMostLagFrames = 4;

/// Of one search.
class PictureLag {
 public:
  explicit PictureLag(std::optional<int> known) : known_(known) {}

  /// Frames; nothing: not known yet.
  const std::optional<int>& known() const { return known_; }
  /// What later searches are to go by: fewer than known() where long moves have shown fewer.
  std::optional<int> Learned() const;
  /// One more long move is to be looked at, since nothing is known.
  bool ToLearn() const { return !known_ && !given_up_; }

  /// A frame after a move came. True: it is to be thrown away.
  bool ThrowsAway(const drivers::Frame& frame);
  /// The frame before was.
  bool has_thrown() const { return !thrown_.empty(); }
  /// The first one after those: what they show of the lag. `before`: the one used before the move;
  /// null: nothing is to be learned from this move.
  void MeasureAnew(const drivers::Frame* before, const drivers::Frame& now, const Window& window);

  /// Frames are taken where the lens stands until two agree. `first`: of that place; `changes`: it differs from so many
  /// before it there.
  void BeginAtRest(const drivers::Frame& first, int changes);
  bool at_rest() const { return !rest_.empty(); }
  enum class AtRest {
    Changed,   ///< it differs from the one before: one more
    Agrees,    ///< with the one before, and there was no other
    Late,      ///< with the one before, unlike those before that: known() has changed
    OddOne,    ///< with an earlier one: that between them is the odd one
    Restless,  ///< no two agree
    TooLate    ///< by more than kMostLagFrames
  };
  AtRest Next(const drivers::Frame& frame, const Window& window);
  /// The two frames that agreed were of a place that looks otherwise than the one before.
  void NotLate() { known_ = 0; }

 private:
  AtRest Rested(AtRest how);
  AtRest LateBy(int changes);

  std::optional<int> known_;
  bool given_up_ = false;
  std::vector<drivers::Frame> thrown_;  ///< frames thrown away since the lens moved last
  int tells_ = 0;                       ///< moves that showed the lag anew ...
  int most_ = 0;                        ///< ... and the greatest of them
  std::vector<drivers::Frame> rest_;    ///< of one place
  int first_changes_ = 0;               ///< before them
  int changes_ = 0;                     ///< between them, and before
  double power_ = 0.0;                  ///< the greatest change
  bool is_noise_ = true;                ///< none of them may be more
};

}  // namespace lensd::autofocus
