// lens-bench rpc: what a question to the daemon costs.
#pragma once

namespace lensd::bench {

/// A row of the table in main.cpp.
int RunRpc(int argc, char** argv);

}  // namespace lensd::bench
