// lens-bench move: how long a ringing actuator takes to stand still, by how it is moved.
#pragma once

namespace lensd::bench {

/// A row of the table in main.cpp.
int RunMove(int argc, char** argv);

}  // namespace lensd::bench
