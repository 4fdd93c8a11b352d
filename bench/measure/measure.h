// The focus measures that lens-bench times and scores, each with the peers of its kind.
#pragma once

namespace lensd::bench {

/// lens-bench measure: the focus measures against OpenCV's and against reading the memory once.
int RunMeasure(int argc, char** argv);

}  // namespace lensd::bench
