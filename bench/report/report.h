// lens-bench evidence and lens-bench report.
#pragma once

namespace lensd::bench {

/// Rows of the table in main.cpp.
int RunEvidence(int argc, char** argv);
int RunReport(int argc, char** argv);

}  // namespace lensd::bench
