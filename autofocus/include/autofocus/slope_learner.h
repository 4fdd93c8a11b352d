// What autofocus runs have shown of a lens: how its blur grows with the motor's positions, against what was told, and
// how much alike on both sides of focus.
#pragma once

#include <optional>
#include <utility>
#include <vector>

namespace lensd::autofocus {

struct Setup;

/// The slope of blur of a lens over the one that was told, as logarithms.
struct KnownSlope {
  double log_factor = 0.0;
  double sigma = 0.0;                     ///< of what the next run will show: 1.96 of it hold 95 %
  int runs = 0;                           ///< that have shown it
  std::optional<double> uneven = {};      ///< Setup::uneven; none: too few runs have shown it
  std::optional<double> last_focus = {};  ///< Setup::last_focus
  bool operator==(const KnownSlope&) const = default;
};

/// A setup that goes by what is known instead of what was told. It must have Setup::blur_px.
void GoBy(const KnownSlope& known, Setup& setup);
/// Whether a slope, over the known one, is another lens'.
bool IsOfAnotherLens(double log_over_known, double sigma);

/// Single runs scatter by more than each can know of itself, so that only their mean counts, with that scatter.
class SlopeLearner {
 public:
  static constexpr std::size_t kFewest = 3, kMost = 10;
  static constexpr double kMostLog = 1.5;  ///< a factor of 4.5 either way: more is no slope of a lens
  /// What a run has shown, as in Verdict.
  struct Shown {
    double log_slope = 0.0;
    std::optional<double> uneven = {};
  };
  SlopeLearner() = default;
  /// From what was kept of an earlier one: `shown` in order, each slope within kMostLog.
  explicit SlopeLearner(std::vector<Shown> shown) : shown_(std::move(shown)) {}

  enum class Learned { Added, AnotherLens };
  /// What one more run has shown. What contradicts those before ends them: it is the first of another lens.
  Learned Add(Shown run);
  /// Nothing: too few runs.
  std::optional<KnownSlope> Known() const;
  const std::vector<Shown>& shown() const { return shown_; }  ///< the newest kMost, the oldest first

 private:
  std::vector<Shown> shown_;
};

}  // namespace lensd::autofocus
