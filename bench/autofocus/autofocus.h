// lens-bench autofocus: methods side by side on one scene, thousands of runs on stepped clocks.
#pragma once

namespace lensd::bench {

int RunAutofocusCommand(int argc, char** argv);

}  // namespace lensd::bench
