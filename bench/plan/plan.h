// lens-bench plan: the planner's speed and error against its peers, on the same problems in one run.
#pragma once

namespace lensd::bench {

int RunPlan(int argc, char** argv);

}  // namespace lensd::bench
