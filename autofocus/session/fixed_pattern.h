// What a sensor adds to every picture in the same place: hot pixels, shadows of dirt on its cover glass, pixels of
// unequal gain. Focus changes none of it. Where little else shows, it is all that sharpness sees, and no top stands
// out.
#pragma once

#include <span>
#include <vector>

#include "autofocus/method.h"

namespace lensd::autofocus {

/// Frames of one window, and what stays in place in them: by pixel the mean of the middle third of frames that are
/// far enough apart to show a scene in other blur, each divided by its light. Scaled to a frame's light, it is taken
/// off; of a frame that is one of them, what the others show, or its own noise would make it smoother than frames that
/// come later. Hot pixels, whose noise is greater too, and those at full scale in most frames show what
/// is beside them.
class FixedPattern {
 public:
  /// Keeps the window of a frame where the lens stood. Nothing is kept any more after 32 MiB in all, or after a window
  /// of another size.
  void Keep(const Look& look);
  /// True: the pattern is known from now on. It needs 6 frames, each 5 px of blur (a twentieth of the range where blur
  /// is not known) from the others, and has to be more than half of the gradient energy, less noise, that the duller
  /// half of them shows: else nothing is gained, or frames are refused for another reason.
  bool Find(const Setup& setup);
  bool known() const { return !pattern_.empty(); }
  bool Fits(const Window& window) const {
    return window.width == kept_.front().window.width && window.height == kept_.front().window.height;
  }
  /// Of the gradient energy of the duller frames; 0..1.
  double share() const { return share_; }
  /// What is kept, without the pattern, in the order taken. Looks without a frame: only tiles and score are of it.
  const std::vector<Look>& Looks() const { return clean_; }
  /// The same of another frame of that window, which has the same size.
  Look Without(const Look& look) const;
  /// That window, in 16 bits.
  drivers::Frame PictureWithout(const drivers::Frame& frame, const Window& window) const;

 private:
  struct Kept {
    double position = 0.0;
    drivers::Frame window;
    double light = 0.0;  ///< mean, in steps
    Bands around;
  };
  static Kept CutOut(const drivers::Frame& frame, const Window& window);
  std::vector<std::size_t> Spread(const Setup& setup) const;
  std::vector<std::vector<std::uint16_t>> FindPattern(std::span<const std::size_t> frames);
  void FindBlock(std::span<const std::size_t> frames, std::size_t first, std::vector<std::vector<std::uint16_t>>& less);
  double ShareOf(std::span<const std::size_t> frames) const;
  static std::uint16_t Less(std::uint16_t sample, float pattern, const Kept& kept);
  drivers::Frame Clean(const Kept& kept) const;
  drivers::Frame FilledIn(const Kept& kept, std::vector<std::uint16_t> samples) const;
  static Look Scored(const Kept& kept, const drivers::Frame& clean);

  std::vector<Kept> kept_;
  std::vector<Look> clean_;
  bool full_ = false;
  std::vector<float> pattern_;  ///< by pixel, over the frames' light; below 0: counts for nothing
  double share_ = 0.0;
};

}  // namespace lensd::autofocus
