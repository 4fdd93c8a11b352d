// Where labels go, so that none covers another, a mark or the frame.
#pragma once

#include <optional>
#include <vector>

#include "bench/report/drawing.h"

namespace lensd::bench {

/// A mark and the size of the label that it wants.
struct Labelled {
  double x = 0.0, y = 0.0;
  double width = 0.0, height = 0.0;  ///< 0: no label, but others keep clear of it
};

/// Where a label went. `leader`: it stands so far off that a line has to lead to it.
struct LabelPlace {
  Box box{};
  bool leader = false;
};

/// A place inside `frame` for every label, as near to its mark as there is room: clear of all marks, of each other and
/// of `taken`. Nothing where there is no such place: the frame has to grow.
std::optional<std::vector<LabelPlace>> PlaceLabels(const Box& frame, const std::vector<Labelled>& marks,
                                                   const std::vector<Box>& taken);

}  // namespace lensd::bench
