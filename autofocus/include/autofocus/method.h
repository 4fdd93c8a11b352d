// The one small interface behind which every autofocus method lives: what it is told before it starts, what it sees,
// and what it answers. Methods are pure: no device, no clock, no I/O; the same looks give the same answers.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "autofocus/measures.h"
#include "autofocus/stars.h"
#include "drivers/api/camera.h"

namespace lensd::autofocus {

/// An answer this far off, in pixels of blur, is half a depth of field off.
inline constexpr double kHalfDepthOfFieldPx = 2.0;

struct TileScores;

/// The lens and camera as far as a method needs them. Positions are extensions in metres where the lens is calibrated,
/// native units where it is not; a method only ever sees one of the two.
struct Setup {
  double lowest = 0.0;            ///< reachable positions
  double highest = 0.0;           ///< > lowest
  double resolution = 0.0;        ///< between neighbouring positions, > 0
  std::optional<double> blur_px;  ///< change of position that changes the blur diameter by one pixel; none: unknown
  /// In units of position: focused at x, blur changes by 1/(1 + x/focal_length) of that; 0: by all of it.
  double focal_length = 0.0;
  bool ascending = true;     ///< sweeps run toward larger positions: the side that takes up the backlash
  bool near_is_high = true;  ///< larger positions focus nearer
  double backlash = 0.0;     ///< lost at a reversal, where it is known well enough to be reckoned with; else 0
  bool pictures = true;      ///< false: sharpness comes ready made, without pictures
  /// How far the lens goes from one frame to the next at its full speed; none: its place is not known in motion.
  std::optional<double> stride = {};
  std::string no_stride = {};  ///< why there is none
  /// At most so far from one frame of the first pass to the next, where the caller says so; >= resolution.
  std::optional<double> step = {};
  /// Of lowest..highest: those of the travel, or of a part of it that the caller chose.
  enum class Ends { Travel, Chosen } ends = Ends::Travel;
  double pixel_m = 0.0;  ///< pitch of the camera's pixels; 0: not known
  /// What is known of its depth: that it stands, so what looks like motion is refused; or that it may move, and is met
  /// where it will be, at the price of a frame or two.
  enum class Subject { Stands, MayMove } subject = Subject::Stands;
  /// Standard deviation of the logarithm of blur_px where runs of this lens have shown it; 0: it was told.
  double slope_sigma = 0.0;
  /// Logarithm of the slope that they showed, over the told one. No disk blurs as a lens does whose slope is another.
  double learned_log_factor = 0.0;
  /// By how much blur on one side of focus may grow otherwise than on the other, as those runs have shown: standard
  /// deviation of half the logarithm of the ratio, its mean included; none: it is not known.
  std::optional<double> uneven = {};
  std::optional<double> last_focus = {};  ///< where the newest of them ended
};

/// One frame.
struct Look {
  double position = 0.0;                              ///< of the lens, at mid-exposure
  double position_sigma = 0.0;                        ///< standard deviation of that
  bool on_the_way = false;                            ///< the lens moved meanwhile; otherwise it stood there
  const drivers::Frame* frame = nullptr;              ///< nullptr: only the score is known
  Window window;                                      ///< where to look, inside the frame
  FocusScore score;                                   ///< of that window
  std::shared_ptr<const TileScores> tiles = nullptr;  ///< the same by small tiles; nullptr: only the score is known
};

/// "Go there and take a frame."
struct GoAndLook {
  double position = 0.0;  ///< within lowest..highest
  /// Above 0: show the frames on the way as well, no farther apart than this, and after each of them the same advice
  /// again means "go on". At most Setup::stride.
  double stride = 0.0;
  bool backlash_open = false;  ///< the backlash need not be taken up: no answer may stand there, but it saves a motion
};

/// A place where something in the region, or one of several regions, is in focus.
struct Candidate {
  double position = 0.0;
  double sigma = 0.0;  ///< standard deviation of `position`; 0: not known
  int region = 0;      ///< index of the region
};

/// What an answer rests on.
enum class FoundBy {
  Sharpness,  ///< the top of the sharpness curve
  Blur,       ///< that, and how blurred the frames around it are: the two agree
  Stars,      ///< where points of light are smallest
};

/// Why a method refuses; Verdict::reason has it in words.
enum class Cause {
  NoTexture,  ///< nothing changes with focus
  TooBright,
  SeveralDepths,
  EndOfTravel,
  SubjectMoved,
  Ambiguous,  ///< several distances look alike
  Unclear,    ///< noise or light leave no clear answer
  Uncalibrated,
  PlaceUnknown,  ///< of the lens at its frames
  Deadline,
  Missed,       ///< the lens did not get where it was sent
  SameFrame,    ///< a frame was the one before, though the lens had moved between
  NotRestored,  ///< focus was found, but the conditions of the search stay, or it could not go on from there
  LateFrames,   ///< frames are of where the lens was before
};

/// The end.
struct Verdict {
  bool focused = false;
  Cause cause = Cause::Unclear;  ///< where not focused
  double position = 0.0;         ///< best focus, where focused
  double sigma = 0.0;            ///< standard deviation of `position`
  FoundBy found_by = FoundBy::Sharpness;
  std::optional<Candidate> subject;   ///< where all frames together place the focus, if better known than by standing
  double confidence = 0.0;            ///< 0..1: how sure the method is that this is the sharpest place
  std::string reason;                 ///< why it believes, or why it refuses: one line for people
  std::vector<Candidate> candidates;  ///< what there was to choose from, where it was more than one
  bool final = false;                 ///< a refusal that no other method could turn into an answer
  bool proven = false;                ///< the method has seen worse frames on both sides, and the last one there
  std::optional<double> log_slope;    ///< of blur, over Setup::blur_px: as the frames about a proved top show it
  std::optional<double> uneven;       ///< half the logarithm of the slope above the top over that below, likewise
  std::optional<StarFigures> stars;   ///< of the last frame, where it was found by them
};

using Advice = std::variant<GoAndLook, Verdict>;

/// What a method expects of a run, from its first look.
struct Forecast {
  double frames = 0.0;  ///< until it answers or refuses
  double chance = 1.0;  ///< of an answer within half a depth of field, above 0
};

class Method {
 public:
  virtual ~Method() = default;
  /// Called with the first frame, taken where the lens happened to stand, then with each frame it asked for.
  virtual Advice Next(const Look& look) = 0;
  /// Frames it expects to need in all before the one at its answer, as far as it can tell.
  virtual int FramesExpected() const = 0;
  /// Before any Next(). By default it trusts itself.
  virtual Forecast Predict(const Look& first) const {
    (void)first;
    return {.frames = FramesExpected() + 1.0, .chance = 0.97};
  }
};

}  // namespace lensd::autofocus
