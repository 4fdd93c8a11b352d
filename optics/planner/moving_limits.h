// What limits leave of the f-number over a stretch of extensions, where their depths may move with the sensor.
#pragma once

#include <optional>
#include <vector>

#include "optics/moving_limits.h"

namespace lensd::optics {

class MovingLimits {
 public:
  explicit MovingLimits(const MovingRequest& asked);

  /// Nothing where no extension and f-number meet all of `names`. Else the names that those which do break; none, where
  /// there may or may not be some.
  std::optional<std::vector<int>> Refute(const std::vector<int>& names) const;
  /// As ExtensionThatHolds().
  std::optional<Metres> Holds() const;
  /// Whether a limit among them moves.
  bool Moves(const std::vector<int>& names) const;

 private:
  struct Ends {
    double low, high;
  };
  /// Everything but the limits' names, in force or not.
  struct Search {
    std::vector<const BlurLimit*> limits;
    Ends extensions, f_numbers;
    bool stops = false;
  };
  struct Found {
    bool certain = true;              ///< that there is none
    std::optional<double> extension;  ///< that holds
  };

  Search SearchOf(const std::vector<int>& names) const;
  Found Find(const Search& search) const;
  /// Where the f-number may lie at best.
  Ends Room(const Search& search, const Ends& extensions) const;
  Ends RoomOf(const BlurLimit& limit, const Ends& extensions) const;
  bool Admits(const Search& search, const Ends& room) const;
  Ends Vergences(const PlanDepth& depth, const Ends& extensions) const;
  Ends BlurTimesN(const PlanDepth& depth, const Ends& extensions) const;
  double LeastSharp(const PlanDepth& depth, const Ends& extensions) const;
  double MostBlurred(const BlurLimit& limit, const Ends& extensions) const;
  double MostToOneSide(const DepthInterval& interval, double sign, const Ends& extensions) const;
  double Reach(const PlanDepth& depth) const;

  const PlanRequest& request_;
  double f_, behind_, delta_, epsilon_, skew_;
  double airy_ = 0.0;
  Ends box_;  ///< of f-numbers
  std::vector<double> stops_;
};

}  // namespace lensd::optics
