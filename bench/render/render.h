// The renderers that lens-bench times and scores against rays.
#pragma once

namespace lensd::bench {

/// lens-bench render: time against error for every renderer and peer.
int RunRender(int argc, char** argv);

}  // namespace lensd::bench
