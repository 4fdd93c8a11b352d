// Columns of limits as lines, the smallest N over them, and who breaks a setting: a vector of limits at a time, for
// whatever vectors the processor has. Every one of them finds the same numbers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "optics/planner_columns.h"

namespace lensd::optics {

enum class Verdict { Feasible, Infeasible, Unsure };

struct Settled {
  Verdict verdict = Verdict::Unsure;
  double n = 0.0, e = 0.0, ratio = 0.0;
  double beyond = 0.0, inside = 0.0;  ///< a point (N, e) a hair inside, all of whose limits hold for certain
};

/// Room for the lines of up to `limits` limits, in doubles.
constexpr std::size_t RoomFor(std::size_t limits) {
  constexpr std::size_t kMostPadding = 16;
  return 4 * (limits + kMostPadding);
}

/// The smallest N over the limits in double precision. `room`: RoomFor() the number of limits; it need hold nothing.
Settled SolveColumns(const ColumnLens& lens, const LimitColumns& limits, double* room);

/// A limit in a working set.
struct LimitIndex {
  enum Kind : std::uint32_t { Sharp, Behind, Front };
  Kind kind;
  std::uint32_t row;
};

/// Adds the limits broken at (n, e) with sharp limits times r and blurred ones over r, the worst of each block.
void CollectBroken(const ColumnLens& lens, const LimitColumns& limits, double n, double e, double r,
                   std::vector<LimitIndex>& broken);

}  // namespace lensd::optics
