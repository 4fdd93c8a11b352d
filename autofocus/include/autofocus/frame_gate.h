// Keeps frames out of a search that do not show the scene as the lens stands: black or white ones, ones of which a part
// is missing or torn, and ones of where the lens was before.
//
// No frame is judged alone, since a scene may be dark, blank or of one value. What makes a frame doubtful is how it
// differs from the one before, or does not differ; then another one is taken at the place, and decides: where it looks
// the same the scene is so, and nothing of the kind is doubted again. The doubts:
//   flat      every pixel has one value, and the frame before was not so; where that is black or full scale, only if
//   that
//             frame was on average 1/64 of full scale off, since points of light on black vanish out of focus;
//   dark      the brightest pixel is darker than the frame before was on average, and its average a quarter of that,
//   and
//             1/64 of full scale less;
//   bright    the other way round, or nearly all of it at full scale;
//   missing   rows at the upper or lower edge have one value, where the frame before shows something;
//   torn      rows there equal those of the frame before bit for bit, though the lens has moved;
//   stale     all of it equals the frame before, or differs from it by noise alone, though the lens has moved by pixels
//   of
//             blur and texture shows; by noise alone only in the first four frames, since a pass looks alike on both
//             sides of its top. From then on a frame is thrown away after each move.
// The first frame has none before it: it is left out where the second one shows that it was dark or had rows missing.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "autofocus/session.h"

namespace lensd::autofocus {

/// What is to become of a frame.
struct Judgement {
  enum class Kind {
    Use,       ///< it goes to the search
    AskAgain,  ///< another one is to be taken where the lens is; the search does not get this one
    UseAnew,   ///< it is the first of a new search: what the search has seen so far is not to be relied on
    Late       ///< frames are of where the lens was before even when one is thrown away after each move
  };
  Kind kind = Kind::Use;
  /// Why the frame before this one was kept out of the search, or is to be taken out of it; empty: it was not.
  std::string before_is_bad;
};

/// Of one search. Looks at the rectangle about all regions.
class FrameGate {
 public:
  explicit FrameGate(const Setup& setup) : setup_(setup) {}
  Judgement Judge(const Place& place, const drivers::Frame& frame, std::span<const drivers::Region> regions);
  /// The search refuses because the picture changed while the lens stood. True: up to two more frames are to be taken
  /// there and given to JudgeChanged(), since a picture that is one move late changes once and then no more.
  bool ToLookAgain() { return !late_ && used_ && !std::exchange(looked_again_, true); }
  /// UseAnew: the picture was late. Use: the refusal stands, and the frame is of no more use.
  Judgement JudgeChanged(const drivers::Frame& frame);

 private:
  enum class Doubt { Flat, Dark, Bright, Missing, Torn, Stale };
  struct Light {
    double mean = 0.0;
    std::uint16_t least = 0, most = 0;
  };
  struct Seen {
    drivers::Frame frame;
    Window window;
    double position = 0.0;
    Light light;
  };

  std::optional<Doubt> DoubtOf(const Seen& now) const;
  bool SettledFor(Doubt doubt) const;
  bool IsStale(const Seen& now) const;
  Judgement Answer(const Seen& now);
  static std::string ReasonOf(Doubt doubt);
  static Light LightOf(const drivers::Frame& frame, const Window& window);
  static bool IsMuchDarker(const Light& dark, const Light& light, double full);

  Setup setup_;
  std::optional<Seen> used_;    ///< the newest frame that went to the search
  int count_ = 0;               ///< of those
  std::optional<Doubt> doubt_;  ///< in the frame before
  bool thrown_away_ = false;    ///< the frame before was
  bool late_ = false;
  bool content_settled_ = false;           ///< a scene that is flat, dark or bright by itself was seen
  bool motion_settled_ = false;            ///< one that looks alike in two places was seen
  bool looked_again_ = false;              ///< after a refusal
  std::optional<drivers::Frame> changed_;  ///< the first of the frames for JudgeChanged()
};

}  // namespace lensd::autofocus
