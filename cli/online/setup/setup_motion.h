// How an axis moves, measured by moving it: for `lensctl setup`.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/link/daemon_client.h"

namespace lensd::cli {

/// Of the range, at each end, where nothing is moved to: an unknown lens may stop before it says so.
inline constexpr double kSetupMargin = 0.1;

/// A measured value and what it lies between: its 95 % interval, or bounds that nothing measured was outside of.
struct Measured {
  double value = 0.0;
  double low = 0.0;
  double high = 0.0;
};
varlink::Json JsonOf(const std::optional<Measured>& measured);

/// A straight line through points, with the halves of Student's 95 % intervals.
struct Line {
  double slope = 0.0, at_zero = 0.0;
  double slope_half = 0.0, zero_half = 0.0;
  double At(double x) const { return at_zero + slope * x; }
};
/// Least squares; nothing where there are fewer than four points, or all are at one x.
std::optional<Line> FitLine(const std::vector<std::pair<double, double>>& points);

/// A move as it was seen from here.
struct TimedMove {
  double distance = 0.0;    ///< native units, above 0
  double elapsed_ms = 0.0;  ///< as MoveResult says
  /// When the position was last told as it was before the move, and first told as another, since the call began; 0 and
  /// 0: it was never seen on its way.
  double still_ms = 0.0, started_ms = 0.0;
  /// Between the first report of the final position and the end, at least and at most.
  double rest_least_ms = 0.0, rest_most_ms = 0.0;
  bool SeenOnTheWay() const { return started_ms > 0.0; }
};

/// What the moves of one axis tell.
struct AxisMotion {
  std::vector<TimedMove> moves;
  std::optional<Measured> speed;        ///< native units a second; none where the time does not grow with the travel
  std::optional<Measured> overhead_ms;  ///< what a move takes beside its travel
  std::optional<Measured> latency_ms;   ///< until the position changes; none where none is seen on its way
  std::optional<Measured> rest_ms;      ///< from the final position to the end of the move
  std::string trouble;                  ///< why it ended early; empty: it did not
};

/// Moves the axis of `info` (an AxisInfo) to and fro within the middle four fifths of its range, over several lengths,
/// and back to where it was, for about `budget`: never nearer to an end than a tenth. Failure: the daemon is gone or
/// refused, or Control-C.
std::expected<AxisMotion, Failure> MeasureMotion(DaemonClient& link, const std::string& lens, const varlink::Json& info,
                                                 double position, Duration budget);

/// Where it goes in turn, from a quarter of `span` above `low`. No length comes twice: the times are read at intervals,
/// and moves of one length would all be rounded the same way, which no scatter shows.
std::vector<double> MotionTargets(double low, double span, double resolution);

/// What the times say: least squares over the distances, for a motor that accelerates evenly, with 95 % intervals by
/// Student's t. Fewer than four moves, one length alone, or a speed that may never have been reached tell none.
void FitMoves(AxisMotion& motion);

/// How long a search for focus may take, ms: a slow lens has more time, by the speed and the overhead that SetupJson
/// gives of its focus, one of `axes`.
double SearchAtMostMs(const varlink::Json& axes);

}  // namespace lensd::cli
