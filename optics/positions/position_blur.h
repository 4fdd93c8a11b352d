// How the limits of a request fare with a lens at one of its positions.
#pragma once

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "optics/focus_blocks.h"
#include "optics/lens_positions.h"
#include "optics/positions/index_stretches.h"

namespace lensd::optics {

/// What ratios go up to: no blur at all where there should be some.
inline constexpr double kMostBlurRatio = 1e9;

/// Everything a limit asks of the opening at one focus position. Blur at f-number N is `geometric`/N and, with
/// diffraction, its root sum square with `diffraction` times N.
struct OpeningNeed {
  double geometric = 0.0;    ///< metres; the greatest (sharp) or least (blurred) within the position's bounds
  double diffraction = 0.0;  ///< metres
  double limit = 0.0;        ///< metres
  bool sharp = true;
  double at = 0.0;  ///< the vergence where that is

  double Blur(double n) const;
  /// Of blur and limit over the f-numbers from `low` to `high`: holds when at most 1.
  double Ratio(double low, double high) const;
};

class PositionBlur {
 public:
  /// All arguments must outlive it.
  PositionBlur(const PlanRequest& request, const LensPositions& lens, const DistanceOrigin& origin);

  std::size_t limits() const { return limits_.size(); }
  OpeningNeed Need(std::size_t limit, const FocusPosition& position) const;
  /// What no position of a sound block asks less than: at most so much blur to be sharp, at least so much to be
  /// blurred. `at` is not told.
  OpeningNeed LeastNeed(std::size_t limit, const FocusRange& block) const;
  /// No position of a sound block focuses nearer to `depth`, in dioptres.
  double LeastOff(const PlanDepth& depth, const FocusRange& block) const;
  /// Nearest and farthest vergence of a limit's depths, as the lens at this position sees them.
  std::pair<double, double> Depths(std::size_t limit, const FocusPosition& position) const;
  /// From the lens centre at this position.
  double Vergence(const PlanDepth& depth, const FocusPosition& position) const;
  /// The vergence of 1/distance from the origin.
  Dioptres Seen(double inverse, const FocusPosition& position) const { return {FromOrigin(inverse, position)}; }
  /// f-numbers that a position may stand for, tolerances of the request included.
  std::pair<double, double> FNumbers(const IrisPosition& position) const;
  /// How far the focal plane may be from where it should, as seen at this vergence, tolerances of the request included.
  double Bound(const FocusPosition& position, double vergence) const;

  /// The request for a lens that has this one position of focus and the f-numbers f(e)/A of the positions of its iris:
  /// depths from its centre, its tolerances.
  enum class Limits { LeftOut, Included };
  PlanRequest AtPosition(const FocusPosition& position, const IrisPosition& iris, Limits limits) const;
  /// f(e)/A over f(0)/A.
  double Breathing(const FocusPosition& position) const;

 private:
  static constexpr double kNone = -std::numeric_limits<double>::infinity();
  /// Ends of depths, in the coordinate they were given in: vergence from the centre, or 1/distance from the origin.
  struct Hull {
    double near = kNone;
    double far = -kNone;
    bool empty() const { return near < far; }
    void Add(double place) {
      near = std::max(near, place);
      far = std::min(far, place);
    }
  };
  using Stretches = std::vector<std::pair<double, double>>;  ///< far and near, rising, apart
  struct Limit {
    const BlurLimit* asked = nullptr;
    Hull vergences{}, distances{};
    /// Of a blurred limit whose side is open.
    Stretches open_vergences{}, open_distances{};
    std::vector<std::pair<double, double>> open_mixed{};  ///< a vergence and a coordinate; both ends are above, too
  };
  Limit LimitOf(const BlurLimit& asked) const;

  /// A distance's coordinate as seen from the lens centre at this position.
  double FromOrigin(double inverse, const FocusPosition& position) const;
  double LeastToEitherSide(const Limit& limit, const FocusPosition& position, double& at) const;
  double Divisor(double vergence, const FocusPosition& position) const;

  using Ends = FocusRange::Ends;
  Ends Divisors(Ends vergence, const FocusRange& block) const;
  double LeastBound(Ends vergence, const FocusRange& block) const;
  double LeastSharp(Ends near, Ends far, const FocusRange& block) const;
  double MostOff(double off, Ends vergence, const FocusRange& block) const;
  double MostBlurred(const Limit& limit, Ends near, Ends far, const FocusRange& block) const;
  double MostToEitherSide(const Limit& limit, const FocusRange& block) const;

  const PlanRequest& request_;
  const LensPositions& lens_;
  DistanceOrigin origin_;
  std::vector<Limit> limits_;
  double larger_, smaller_;  ///< what the focal length's error does to blur
  double skew_;              ///< 1/p - 1
  double airy_ = 0.0;        ///< diffraction disk over working f-number
};

/// The positions a request admits, as indices of LensPositions, rising.
struct PositionChoice {
  IndexStretches focus;
  std::vector<std::size_t> iris;
  bool focus_reachable = true;  ///< a fixed focus lies between the positions, or half a step beyond their ends
};
PositionChoice ChoiceOf(const PlanRequest& request, const LensPositions& lens, const FocusBlocks& blocks,
                        const PositionBlur& blur);

}  // namespace lensd::optics
