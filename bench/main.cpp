// lens-bench: speed against accuracy of each family of algorithms, with its peers, in one run.
#include <sysexits.h>

#include <iomanip>
#include <iostream>
#include <string>
#include <string_view>
#include <vector>

#include "base/nearest_word.h"
#include "bench/autofocus/autofocus.h"
#include "bench/command.h"
#include "bench/drivers/drivers.h"
#include "bench/gallery/gallery.h"
#include "bench/measure/measure.h"
#include "bench/move/move.h"
#include "bench/plan/plan.h"
#include "bench/render/render.h"
#include "bench/report/report.h"
#include "bench/rpc/rpc.h"

namespace lensd::bench {
namespace {

/// The command was moved into lensctl. For one release its old name says so to scripts that still call it.
int NameVerify(int, char**) {
  std::cerr << "lens-bench verify: this is a command of lensctl now: lensctl verify; see lensctl verify --help\n";
  return EX_USAGE;
}

/// Every subcommand. One line each, declared in the command's own header.
const std::vector<Command>& Commands() {
  static const std::vector<Command> commands = {
      {"autofocus", "methods side by side on one scene: frames, time, error, refusals", RunAutofocusCommand},
      {"drivers", "drivers on simulated devices: what calls and moves cost, what a bad wire does", RunDrivers},
      {"evidence", "all of these, every figure kept with its command: resumable", RunEvidence},
      {"gallery", "the lecture's optics: charts, and rendered frames that show the same", RunGallery},
      {"measure", "focus measures against OpenCV's and one read of the memory", RunMeasure},
      {"move", "a step of a ringing actuator, raw and shaped: what is left when", RunMove},
      {"plan", "the planner against its peers: time and error on the same problems", RunPlan},
      {"render", "renderers and their peers: time against error, cost against disk diameter", RunRender},
      {"report", "one page of charts from what evidence kept; --quick --baseline: a guard", RunReport},
      {"rpc", "what a question to the daemon costs, beside a bare socket and sd-bus", RunRpc},
      {"verify", "is a command of lensctl now: lensctl verify", NameVerify},
  };
  return commands;
}

void PrintHelp(std::ostream& out) {
  out << "usage: lens-bench COMMAND [OPTIONS]    (lens-bench COMMAND --help tells more)\n\n";
  for (const Command& command : Commands()) {
    out << "  " << std::left << std::setw(12) << command.name << command.help << "\n";
  }
}

int Run(int argc, char** argv) {
  const std::string_view name = argc > 1 ? argv[1] : "";
  if (name == "--help" || name == "-h" || name == "help") {
    PrintHelp(std::cout);
    return EX_OK;
  }
  if (name == "--version") {
    std::cout << "lens-bench " LENSD_VERSION "\n";
    return EX_OK;
  }
  for (const Command& command : Commands()) {
    if (command.name != name) continue;
    std::string called = "lens-bench " + std::string(name);
    argv[1] = called.data();
    return command.run(argc - 1, argv + 1);
  }
  if (name.empty()) {
    PrintHelp(std::cerr);
  } else {
    std::vector<std::string> names;
    for (const Command& command : Commands()) names.emplace_back(command.name);
    const auto meant = NearestWord(name, names);
    std::cerr << "lens-bench: there is no command '" << name << "'" << (meant ? "; did you mean " + *meant + "?" : "")
              << "; lens-bench --help lists them\n";
  }
  return EX_USAGE;
}

}  // namespace
}  // namespace lensd::bench

int main(int argc, char** argv) {
  return lensd::bench::Run(argc, argv);
}
