// Keeps frames out of a search that do not show the scene as the lens stands: black or white ones, ones of which a part
// is missing or torn, and ones of where the lens was before.
//
// No frame is judged alone, since a scene may be dark, blank or of one value. What makes a frame doubtful is how it
// differs from the one before, or does not differ; then another one is taken at the place, and decides: where it looks
// the same the scene is so, and nothing of the kind is doubted again. The doubts:
//   flat      every pixel has one value, and the frame before was not so; where that is black or full scale, only if
//             the frame before was on average 1/64 of full scale off, since points of light on black vanish out of
//             focus;
//   dark      the brightest pixel is darker than the frame before was on average, and its average a quarter of that
//             frame's and 1/64 of full scale less;
//   bright    the other way round, or nearly all of it at full scale;
//   missing   rows at the upper or lower edge have one value, where the frame before shows something;
//   torn      rows there equal those of the frame before bit for bit, though the lens has moved;
//   stale     all of it equals the frame before, or differs from it by noise alone, though the lens has moved by pixels
//             of blur. Of lensd's own camera, by noise alone only where texture shows, and in the first four frames,
//             since a pass looks alike on both sides of its top. A client's frame that does not clearly differ is
//             doubted too, up to three times in vain; its first one is compared with the last one of the search before.
// A stale frame, a picture that changes while the lens stands, and a camera of which nothing is known lead to the lag
// of its picture (PictureLag): from then on frames are thrown away after each move. The first frame has none before it:
// it is left out where the second one shows that it was dark or had rows missing.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "autofocus/picture_lag.h"
#include "autofocus/session.h"

namespace lensd::autofocus {

/// Why a frame of which nothing is wrong is not used: Judgement::before_is_bad.
inline constexpr const char* kTakenTwice = "it was taken twice, to learn by how many frames the picture is late";
inline constexpr const char* kDoubtedInVain = "it was taken twice, since it was in doubt: both frames look the same";

/// What is to become of a frame.
struct Judgement {
  enum class Kind {
    Use,       ///< it goes to the search
    AskAgain,  ///< another one is to be taken where the lens is; the search does not get this one
    UseAnew,   ///< it is the first of a new search: what the search has seen so far is not to be relied on
    Late       ///< by more frames than can be thrown away, or where the lens cannot wait for them
  };
  Kind kind = Kind::Use;
  /// Why the frame before this one was kept out of the search, or is to be taken out of it; empty: it was not.
  std::string before_is_bad;
};

/// What a search leaves of its last frame for the search after it.
struct LastFrame {
  drivers::Frame part;              ///< the samples of `window` alone
  Window window;                    ///< of the whole picture; at most 256 px each way
  int width_px = 0, height_px = 0;  ///< of the whole picture
  double position = 0.0;            ///< as those of Setup
};

/// What one part of a picture shows of light, in samples.
struct LightOfPart {
  double mean = 0.0;
  std::uint16_t least = 0, most = 0;
};

/// Of one search. Looks at the rectangle about all regions.
class FrameGate {
 public:
  /// Inside: frames of lensd's own camera, whose driver says when each was exposed. Outside: a client says so.
  enum class Source { Inside, Outside };
  /// `lag`: by how many frames the camera's picture is late; nothing: not known. `before`: of the search before, with
  /// the same camera as far as is known; nothing: there was none, or its last frame is not to be looked at.
  FrameGate(const Setup& setup, std::optional<int> lag, Source source, std::optional<LastFrame> before)
      : setup_(setup), source_(source), lag_(lag), before_(std::move(before)) {}
  Judgement Judge(const Place& place, const drivers::Frame& frame, std::span<const drivers::Region> regions);
  /// Of a score without its picture: whether another one is to be taken at its place.
  bool ThrowsAwayScore(const Place& place);
  /// The reason, for the picture or score that was.
  std::string WhyThrownAway() const;
  /// The search ends with this verdict. True: before it counts, more frames are to be taken where the lens stands, and
  /// given to JudgeAtRest(): the picture changed there, nothing is known of its lag, or a client took it.
  bool ToLookAgain(const Verdict& verdict);
  /// UseAnew: the picture was late. Use: the verdict stands, and the frame is of no more use.
  Judgement JudgeAtRest(const drivers::Frame& frame);
  /// As later searches are to take it; nothing: not known.
  std::optional<int> lag() const { return lag_.Learned(); }
  /// For the search after this one; nothing: no picture was used.
  std::optional<LastFrame> last_frame() const;

 private:
  enum class Doubt { Flat, Dark, Bright, Missing, Torn, Stale };
  struct Seen {
    drivers::Frame frame;
    Window window;
    double position = 0.0;
    LightOfPart light;
  };

  std::optional<Doubt> DoubtOf(const Seen& now) const;
  bool SettledFor(Doubt doubt) const;
  bool IsFar(double from, double to) const;
  bool IsOfTheSearchBefore(const Seen& now) const;
  bool IsStale(const Seen& now) const;
  bool Moved(double position) const;
  Judgement Answer(const Seen& now);
  Judgement NextAtRest(const Seen& now, bool after_a_move);
  Judgement AgreesAtTheEnd(const Seen& now);
  Judgement Used(const Seen& now, Judgement judged);
  static std::string ReasonOf(Doubt doubt);
  static LightOfPart LightOf(const drivers::Frame& frame, const Window& window);
  static bool IsMuchDarker(const LightOfPart& dark, const LightOfPart& light, double full);

  Setup setup_;
  Source source_;
  std::optional<Seen> used_;    ///< the newest frame that went to the search
  int count_ = 0;               ///< of those
  std::optional<Doubt> doubt_;  ///< in the frame before
  int stale_ = 0;               ///< frames that were doubted so, one after the other
  PictureLag lag_;
  std::optional<LastFrame> before_;
  bool content_settled_ = false;  ///< a scene that is flat, dark or bright by itself was seen
  int in_vain_ = 0;               ///< doubts that a frame is, in part or whole, of where the lens was before
  int looked_again_ = 0;          ///< after verdicts
  int agreed_ = 0;                ///< frames with the one at the end of the newest of these, in a row
};

}  // namespace lensd::autofocus
