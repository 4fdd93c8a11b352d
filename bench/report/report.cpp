// The commands `evidence` (runs everything and keeps the figures) and `report` (draws the page from kept figures).
#include "bench/report/report.h"

#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <iostream>

#include "bench/command.h"
#include "bench/evidence/gather.h"
#include "bench/report/guard.h"
#include "bench/report/page.h"
#include "io/atomic_file.h"

namespace lensd::bench {
namespace {

namespace fs = std::filesystem;

int Complain(const char* command, const Error& error) {
  std::cerr << "lens-bench " << command << ": " << error.message << "\n";
  return error.code == Code::BadData ? EX_DATAERR : error.code == Code::Io ? EX_IOERR : EX_SOFTWARE;
}

void Say(const std::string& line) {
  std::cerr << line << std::endl;
}

struct EvidenceOptions {
  std::string directory = "docs/evidence/runs";
  std::vector<std::string> families, scenes;
  EvidenceSources sources;
  bool quick = false, long_runs = false;
};

int MakeEvidence(const EvidenceOptions& options) {
  const Counts counts = options.quick ? Counts::Quick : options.long_runs ? Counts::Long : Counts::Small;
  const auto done =
      Gather(EvidenceJobs(counts, options.sources),
             {.directory = options.directory, .families = options.families, .scenes = options.scenes}, Say);
  return done ? EX_OK : Complain("evidence", done.error());
}

struct ReportOptions {
  std::string directory;
  std::string evidence = "docs/evidence/runs";
  std::string baseline;
  bool quick = false;
};

Result<void> WritePage(const fs::path& directory, const Evidence& rows) {
  std::error_code trouble;
  fs::create_directories(directory, trouble);
  std::vector<std::pair<std::string, std::string>> files = {
      {"report.html", PageOf(rows)}, {"evidence.csv", CsvOf(rows)}, {"evidence.json", JsonOf(rows)}};
  for (const Figure& figure : AllFigures(rows)) {
    files.emplace_back(figure.id + ".svg", ChartFileOf(figure));
    files.emplace_back(figure.id + ".csv", MarksFileOf(figure));
  }
  for (const auto& [name, text] : files) {
    if (auto written = io::WriteFileAtomically((directory / name).string(), text); !written) return written;
  }
  return {};
}

/// What became worse than the baseline, told line by line; 1 where anything did. A slow spell of the machine passes:
/// what is worse has to be worse again when it is run `again`.
int Judge(Evidence rows, const std::string& path, const std::function<Result<Evidence>()>& again) {
  const auto text = io::ReadWholeFile(path);
  if (!text) return Complain("report", text.error());
  const auto baseline = RowsFromCsv(*text, path);
  if (!baseline) return Complain("report", baseline.error());
  std::vector<std::string> worse = WorseThan(*baseline, rows);
  if (!worse.empty() && again) {
    for (const std::string& line : worse) std::cerr << line << "; once more\n";
    auto more = again();
    if (!more) return Complain("report", more.error());
    worse = WorseThan(*baseline, *more);
  }
  const bool same = !baseline->empty() && !rows.empty() &&
                    baseline->front().made.machine == rows.front().made.machine &&
                    baseline->front().made.compiler == rows.front().made.compiler;
  if (!same) std::cout << "another machine or compiler than the baseline's: times were not compared\n";
  for (const std::string& line : worse) std::cout << line << "\n";
  if (worse.empty()) std::cout << "nothing is worse than " << path << "\n";
  return worse.empty() ? EX_OK : 1;
}

int Report(const ReportOptions& options) {
  const std::string fresh = (fs::path(options.directory) / "runs").string();
  const auto run = [&]() -> Result<Evidence> {
    std::error_code ignored;
    fs::remove_all(fresh, ignored);
    if (const auto done = Gather(EvidenceJobs(Counts::Quick, {}), {.directory = fresh}, Say); !done)
      return PassOn(done);
    return LoadEvidence(fresh);
  };
  const auto rows = options.quick ? run() : LoadEvidence(options.evidence);
  if (!rows) return Complain("report", rows.error());
  if (const auto written = WritePage(options.directory, *rows); !written) return Complain("report", written.error());
  std::cout << (fs::path(options.directory) / "report.html").string() << "\n";
  if (options.baseline.empty()) return EX_OK;
  return Judge(*rows, options.baseline, options.quick ? std::function<Result<Evidence>()>(run) : nullptr);
}

}  // namespace

int RunEvidence(int argc, char** argv) {
  CLI::App app(
      "Runs every family and keeps each figure with its command, seed, commit and machine as FOLDER/FAMILY/SCENE.csv.\n"
      "What is there with the same command is not run again: it may be stopped at any time and begun again.\n"
      "Run it from the sources' folder, on a machine that does nothing else.");
  EvidenceOptions options;
  app.add_option("-o,--output", options.directory, "folder of the CSV files")->capture_default_str();
  app.add_option("--family", options.families, "only these: autofocus, drivers, measure, move, plan, render, rpc");
  app.add_option("--only", options.scenes, "only what begins so, as the files are named: \"regimes\", \"score page\"");
  app.add_option("--runs", options.sources.runs,
                 "searches of autofocus a method and scene, starts a region of stacks, instead of the counts'")
      ->check(CLI::PositiveNumber);
  app.add_option("--scenes", options.sources.scenes, "folder with score/ and regimes/")->capture_default_str();
  app.add_option("--stacks", options.sources.stacks, "folder of focal stacks")->capture_default_str();
  app.add_flag("--quick", options.quick, "as little as a guard needs: a minute");
  app.add_flag("--long", options.long_runs, "the counts that published figures should have: many hours");
  return ParseThen(app, argc, argv, [&] { return MakeEvidence(options); });
}

int RunReport(int argc, char** argv) {
  CLI::App app(
      "Draws report.html, one page that needs nothing else, with evidence.csv, evidence.json and each chart as SVG "
      "and\n"
      "CSV beside it, from the figures that `lens-bench evidence` kept. Takes seconds.");
  ReportOptions options;
  app.add_option("-o,--output", options.directory, "folder, made where it is missing")->required();
  app.add_option("--evidence", options.evidence, "folder of the CSV files")->capture_default_str();
  app.add_flag("--quick", options.quick, "run as little of everything as a guard needs, and draw that instead");
  app.add_option("--baseline", options.baseline,
                 "CSV to be held to: exit status 1 where accuracy is worse beyond its interval, or a ratio to a floor "
                 "or peer by more than 30 % in two of three repeats");
  return ParseThen(app, argc, argv, [&] { return Report(options); });
}

}  // namespace lensd::bench
