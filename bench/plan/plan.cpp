// The command `plan`: sets of problems, methods, and where the figures go.
#include "bench/plan/plan.h"

#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <iostream>

#include "bench/command.h"
#include "bench/outputs.h"
#include "bench/plan/needs.h"
#include "bench/plan/report.h"

namespace lensd::bench {
namespace {

struct Options {
  int rounds = 7;
  std::uint64_t seed = 1;
  bool quick = false;
  bool json = false;
  int regimes = 0;  ///< problems of each
  int needs = 0;    ///< plans of each kind
  std::string csv;
  std::string svg;
};

std::vector<ProblemSet> Sets(const Options& options) {
  if (options.regimes > 0) return RegimeSets(options.seed, options.regimes);
  std::vector<ProblemSet> sets;
  sets.push_back(MixedLimits("up to 8 limits", options.seed, options.quick ? 50 : 200, 1, 8));
  sets.push_back(MixedLimits("100 limits", options.seed + 1, options.quick ? 8 : 50, 100, 100));
  sets.push_back(ManyDepths("65,536 named depths", options.seed + 2, 65536));
  return sets;
}

std::vector<Method> AllMethods() {
  std::vector<Method> methods = {Lensd(), ReadRequestOnce()};
  methods.push_back(TextbookFormula());
  methods.push_back(ImageMidpoint());
  methods.push_back(GridSearch(100));
  methods.push_back(GridSearch(1000));
  methods.push_back(Bisection());
  methods.push_back(NloptSlsqp());
  methods.push_back(ClpDual());
  methods.push_back(ExactReference());
  return methods;
}

/// Which camera model plans need, from trivial to hard.
int BenchNeeds(const Options& options) {
  std::vector<nlohmann::ordered_json> rows;
  for (const ModelNeed& need : MeasureNeeds(options.needs, options.seed)) {
    rows.push_back({{"plan", need.plan},
                    {"problems", need.problems},
                    {"models", need.models},
                    {"simpler", need.simpler},
                    {"beyond", need.beyond},
                    {"errorUm", need.error_um},
                    {"boundUm", need.bound_um},
                    {"toleranceUm", need.tolerance_um},
                    {"chosenUs", need.chosen_us},
                    {"heaviestUs", need.heaviest_us}});
  }
  return WriteOutputs("plan", rows, {}, {.csv = options.csv, .svg = {}, .as_json = options.json},
                      [] { return std::string(); });
}

int Bench(const Options& options) {
  if (options.needs > 0) return BenchNeeds(options);
  const std::vector<Method> methods = AllMethods();
  for (const Method& method : methods) {
    if (!method.missing.empty()) {
      std::cerr << "lens-bench plan: without " << method.name << ": build with " << method.missing
                << " (script/bootstrap bench installs it)\n";
    }
  }
  std::vector<Measured> rows;
  for (const ProblemSet& set : Sets(options)) {
    const std::vector<Measured> more = Measure(set, methods, options.rounds);
    rows.insert(rows.end(), more.begin(), more.end());
  }
  const std::vector<Measured> depth_map =
      options.regimes > 0 ? std::vector<Measured>() : MeasureDepthMap(1'000'000, options.seed, options.rounds);
  rows.insert(rows.end(), depth_map.begin(), depth_map.end());
  for (const auto& [path, write] : {std::pair{options.csv, &WritePlanCsv}, {options.svg, &WritePlanSvg}}) {
    if (path.empty()) continue;
    if (const auto written = write(rows, path); !written) {
      std::cerr << "lens-bench plan: " << written.error().message << "\n";
      return EX_IOERR;
    }
  }
  if (options.json) {
    std::cout << PlanJson(rows) << "\n";
  } else {
    PrintTable(rows, std::cout);
  }
  return EX_OK;
}

}  // namespace

int RunPlan(int argc, char** argv) {
  CLI::App app(
      "time against error of the planner and its peers; error is the f-number's, relative to exact arithmetic");
  Options options;
  app.add_option("--rounds", options.rounds, "rounds; medians over them are reported")->check(CLI::Range(1, 1000));
  app.add_option("--seed", options.seed, "seed of the problems");
  app.add_flag("--quick", options.quick, "fewer and smaller problems");
  app.add_option("--regimes", options.regimes, "instead: so many problems of each regime in which planners fail")
      ->check(CLI::Range(1, 1'000'000));
  app.add_option("--needs", options.needs, "instead: which camera model so many plans of each kind need")
      ->check(CLI::Range(1, 100'000));
  app.add_option("--csv", options.csv, "write the table as CSV");
  app.add_option("--svg", options.svg, "draw time against error");
  app.add_flag("--json", options.json, "print the table as one line of JSON");
  return ParseThen(app, argc, argv, [&] { return Bench(options); });
}

}  // namespace lensd::bench
