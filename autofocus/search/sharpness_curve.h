// What every method that samples the sharpness curve has to judge in the same way: is there a peak, where is it, and
// may it be believed.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "autofocus/measures/tile_scores.h"
#include "autofocus/method.h"
#include "autofocus/peak_fit.h"

namespace lensd::autofocus {

/// A frame of the curve.
struct CurveSample {
  double position = 0.0;
  double position_sigma = 0.0;
  FocusScore score;
  std::shared_ptr<const TileScores> tiles;
};

/// Where a part of the window is sharpest.
struct PartPeak {
  double position = 0.0;
  double weight = 0.0;  ///< 0..1: how much texture it shows beside the others
};

/// How much texture a small part of the window shows.
struct TexturePart {
  double x = 0.0;  ///< its middle, as fractions of the window
  double y = 0.0;
  double weight = 0.0;  ///< what focus changes of its gradient energy, any unit
};

/// What a frame shows in the window and beside it. Energies are sums of gradient energy over pixels.
struct FrameEnergy {
  CurvePoint whole;        ///< sharpness of the whole window, nothing left out
  double clipped = 0.0;    ///< share of the window whose scores contain light too bright for the sensor
  double left = 0.0;       ///< energy, less noise, of what is not left out
  Bands beside;            ///< noise included
  double noise = 0.0;      ///< energy of a pixel
  double light = 0.0;      ///< mean, of what is not left out
  double all_light = 0.0;  ///< mean, of the whole window
};

/// Sharpness against position. What is too bright for the sensor in any frame is left out of all of them, so that the
/// values can be compared.
class SharpnessCurve {
 public:
  void Add(const Look& look);
  std::size_t size() const { return samples_.size(); }
  /// Of the first frame; nullptr: none, or only scores are known.
  const TileScores* FirstTiles() const { return samples_.empty() ? nullptr : samples_.front().tiles.get(); }
  /// All frames in the order they were taken.
  std::vector<CurvePoint> Taken() const;
  /// All frames in order of position.
  std::vector<CurvePoint> Points() const;
  /// So much of the window is left out that the rest says nothing.
  bool Overexposed() const;
  /// Where parts of the window, at least 32 px a side, are sharpest: one place for each part that shows texture, in
  /// order of position.
  std::vector<PartPeak> PartPeaks() const;
  /// By tile; nothing of those left out.
  std::vector<TexturePart> Texture() const;
  /// All frames in the order they were taken; empty: only scores are known.
  std::vector<FrameEnergy> Energies() const;
  /// Some of the window, as too bright.
  bool LeavesOut() const;

 private:
  /// What of the window counts.
  struct Parts {
    bool finer = false;          ///< by TileScores::finer
    std::vector<char> left_out;  ///< by tile
  };
  Parts WithoutClipped() const;
  static const TileScores& TilesOf(const CurveSample& sample, const Parts& parts);
  double Noise(const Parts& parts) const;

  std::vector<CurveSample> samples_;
};

/// What was seen on one side of a place.
enum class SideSeen {
  Nothing,    ///< no frame there
  LessSharp,  ///< one that is clearly less sharp, by more than noise and flicker
  Sharper,    ///< one that is clearly sharper
  Alike,      ///< none of these
};
/// Of the points whose distance from `centre` is within `least`..`most`, both of one sign.
SideSeen SeenOnSide(std::span<const CurvePoint> points, const CurvePoint& centre, double least, double most);

/// Positions a pixel of blur where what is near counts: as told or as learned, whichever is less. Frames that showed
/// less blur than was told are of light that is no disk, or of another lens. Needs blur_px.
double NearPx(const Setup& setup);

/// Where a frame beside a place tells whether the place is a top: at least and at most so far away, and how far by
/// choice.
struct SideReach {
  double least = 0.0;
  double most = 0.0;
  double wanted = 0.0;
};
SideReach ReachOfSides(const Setup& setup);

/// The depths that the parts come to, where too many of them are sharpest far from `best`; empty: they agree.
std::vector<double> SeveralDepths(const Setup& setup, const std::vector<PartPeak>& peaks, double best);

/// Why an answer is refused, for programs and for people.
struct Why {
  Cause cause;
  std::string_view reason;
};
inline constexpr Why kSeveralDepths{Cause::SeveralDepths,
                                    "parts of the region are in focus at different distances: choose a smaller region"};
inline constexpr Why kTooBright{Cause::TooBright,
                                "parts of the region are too bright for the sensor, and too little is left"};
/// Why what the last frame shows is no top of the window's own: it is the blur of what lies beside the window, or the
/// parts too bright for the sensor are sharper elsewhere. Nothing: no reason to doubt it.
std::optional<Why> DoubtOfLast(const Setup& setup, const SharpnessCurve& curve);
/// Sharpest at the end of the travel, or of the part that was asked for.
Why AtTheEndOf(const Setup& setup);

/// The top of a curve that stands out of the noise.
struct CurveTop {
  std::size_t index = 0;
  double prominence = 0.0;  ///< of the top over the rest, in standard deviations
  double rest = 0.0;        ///< what the curve comes down to away from its top
};
/// Nothing: no peak that stands out. `points` in order of position, not empty.
std::optional<CurveTop> TopOf(const std::vector<CurvePoint>& points);

/// Why TopOf() finds nothing, for people.
inline constexpr Why kNoPeak{
    Cause::NoTexture, "nothing in the region changes with focus: no texture, too much noise, or too little light"};

Verdict Refuse(Why why);

/// Whether the top is one of the ends of the travel, or so near to one that noise and flicker may have put it there.
bool AtTheEnd(const Setup& setup, const std::vector<CurvePoint>& points, const CurvePoint& top);

/// The verdict about the peak at `top`, from the points within `reach` of it. `step`: between neighbouring frames
/// there.
Verdict JudgePeak(const Setup& setup, const SharpnessCurve& curve, const std::vector<CurvePoint>& points,
                  const CurveTop& top, double reach, double step);

}  // namespace lensd::autofocus
