// lens-bench report: every family's figures as one page.
#pragma once

namespace lensd::bench {

int RunReport(int argc, char** argv);

}  // namespace lensd::bench
