// Jobs of autofocus. Its times are those of the simulated clock and its results do not hang on the machine, so nothing
// is pinned and nothing is repeated.
#include "bench/evidence/autofocus_jobs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <sstream>

#include "bench/autofocus/variations.h"
#include "bench/evidence/timing_jobs.h"

namespace lensd::bench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using Rows = std::vector<EvidenceRow>;
using Answers = std::vector<json>;

constexpr const char* kSeed = "7";
constexpr const char* kSweepScene = "score/foliage.toml";
/// What is swept: ours, and two peers.
constexpr const char* kSwept = "auto,fibonacci,hill-climb";
/// Those that take fifty or a hundred frames a run are charted on the real stacks alone.
constexpr const char* kCharted = "auto,defocus,sweep,coarse-fine,fibonacci,hill-climb,sweep-parabola,contrast-scan";

std::string RoleOf(const std::string& method) {
  const std::array ours = {"auto", "defocus", "sweep", "moving"};
  return std::ranges::find(ours, method) != ours.end() ? "ours" : "peer";
}

std::vector<double> ListOf(const json& list) {
  std::vector<double> values;
  for (const json& value : list) {
    values.push_back(value.is_number() ? value.get<double>() : std::numeric_limits<double>::infinity());
  }
  return values;
}

/// How often intervals of several widths hold the truth, of the answers that come with a standard deviation.
void AddClaims(const EvidenceRow& like, const json& off_sigmas, Rows& rows) {
  // Two-sided points of the normal distribution.
  constexpr std::array<std::pair<const char*, double>, 5> kWidths{{{"claim of 50 % holds", 0.6744898},
                                                                   {"claim of 80 % holds", 1.2815516},
                                                                   {"claim of 90 % holds", 1.6448536},
                                                                   {"claim of 95 % holds", 1.9599640},
                                                                   {"claim of 99 % holds", 2.5758293}}};
  std::vector<double> claims;
  for (const json& off : off_sigmas) {
    if (off.is_number()) claims.push_back(std::abs(off.get<double>()));
  }
  if (claims.empty()) return;
  for (const auto& [measure, width] : kWidths) {
    const auto held = std::ranges::count_if(claims, [width](double off) { return off <= width; });
    rows.push_back(ShareRow(like, measure, static_cast<int>(held), static_cast<int>(claims.size())));
  }
}

/// Shares of the four ways to end, and medians of what the runs took.
Rows MethodRows(const EvidenceRow& like, const json& answer) {
  EvidenceRow row = like;
  row.method = answer["method"];
  row.role = RoleOf(row.method);
  const json& each = answer["each"];
  const int runs = static_cast<int>(each["outcome"].size());
  Rows rows;
  for (const char* outcome : {"within", "off", "refused", "false"}) {
    const auto hits = std::ranges::count(each["outcome"], outcome);
    rows.push_back(ShareRow(row, outcome, static_cast<int>(hits), runs));
  }
  rows.push_back(MedianRow(row, "frames", "frames", ListOf(each["frames"])));
  rows.push_back(MedianRow(row, "moves", "moves", ListOf(each["moves"])));
  rows.push_back(MedianRow(row, "time", "ms", ListOf(each["elapsedMs"])));
  if (!row.sweep.empty()) return rows;
  const std::vector<double> elapsed = ListOf(each["elapsedMs"]), cpu = ListOf(each["cpuMs"]);
  std::vector<double> waited;
  std::ranges::transform(elapsed, cpu, std::back_inserter(waited), std::plus());
  rows.push_back(MedianRow(row, "time with computing", "ms", waited));
  rows.push_back(MedianRow(row, "floor of the time", "ms", ListOf(each["knownMs"])));
  rows.push_back(MedianRow(row, "cpu", "ms", cpu));
  AddClaims(row, each["offSigmas"], rows);
  // What is left counts for the runs that claim focus: a refusal is no answer.
  std::vector<double> errors, bounds;
  const std::vector<double> all = ListOf(each["errorPx"]), floors = ListOf(each["boundPx"]);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (each["outcome"][i] == "refused") continue;
    errors.push_back(all[i]);
    if (floors[i] < std::numeric_limits<double>::infinity()) bounds.push_back(floors[i]);
  }
  if (!errors.empty()) rows.push_back(MedianRow(row, "error", "px of blur", errors));
  // The bound is a standard deviation; half of all errors of a normal distribution lie within 0.6745 of it.
  for (double& bound : bounds) bound *= 0.6744897501960817;
  if (!bounds.empty()) rows.push_back(MedianRow(row, "floor of the error", "px of blur", bounds));
  return rows;
}

Rows SceneRows(const EvidenceRow& like, const Answers& answers) {
  Rows rows;
  for (const json& answer : answers.front()) {
    Rows more = MethodRows(like, answer);
    std::move(more.begin(), more.end(), std::back_inserter(rows));
  }
  return rows;
}

Rows StackRows(const EvidenceRow& like, const Answers& answers) {
  Rows rows;
  for (const json& line : answers.front()) {
    EvidenceRow row = like;
    row.method = line["method"];
    row.role = RoleOf(row.method);
    row.scene = line["regions"];
    if (row.scene.find(", ") != std::string::npos) continue;  // kinds alone; stacks are in those
    row.scene = "real stacks, " + row.scene;
    const int runs = line["runs"];
    for (const char* outcome : {"within", "off", "refused", "false"}) {
      rows.push_back(ShareRow(row, outcome, line[outcome], runs));
    }
    rows.push_back(MedianRow(row, "frames", "frames", ListOf(line["each"]["frames"])));
  }
  return rows;
}

std::vector<std::string> FilesIn(const std::string& folder) {
  std::vector<std::string> files;
  std::error_code trouble;
  for (const auto& entry : fs::directory_iterator(folder, trouble)) {
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  }
  std::ranges::sort(files);
  return files;
}

EvidenceJob SceneJob(const std::string& file, const std::string& methods, int runs) {
  return {
      .family = "autofocus",
      .scene = fs::path(file).parent_path().filename().string() + " " + fs::path(file).stem().string(),
      .arguments = {"--scene", file, "--method", methods, "--runs", std::to_string(runs), "--seed", kSeed, "--each"},
      .pinned = false,
      .seed = kSeed,
      .rows = SceneRows};
}

void AddSweeps(std::vector<EvidenceJob>& jobs, const std::string& scenes, const std::string& methods, int runs) {
  for (const Variation& variation : Variations()) {
    for (const double value : variation.values) {
      EvidenceJob job = SceneJob(scenes + "/" + kSweepScene, methods, std::min(runs, variation.most_runs));
      std::ostringstream vary;
      vary << variation.name << '=' << value;
      job.scene = "sweep " + std::string(variation.name);
      job.sweep = variation.axis;
      job.value = value;
      job.arguments.insert(job.arguments.end(), {"--vary", vary.str()});
      jobs.push_back(std::move(job));
    }
  }
}

}  // namespace

std::vector<EvidenceJob> AutofocusJobs(Counts counts, const EvidenceSources& sources) {
  std::vector<EvidenceJob> jobs;
  if (counts == Counts::Quick) {
    for (const char* scene : {"/score/page.toml", "/score/foliage-dim.toml", "/regimes/gradient.toml"}) {
      jobs.push_back(SceneJob(sources.scenes + scene, "auto", 8));
    }
    return jobs;
  }
  const bool small = counts == Counts::Small;
  jobs.push_back({.family = "autofocus",
                  .scene = "real stacks",
                  .arguments = {"--replay", sources.stacks, "--method", small ? kCharted : "all", "--starts",
                                sources.runs > 0 ? std::to_string(sources.runs)
                                : small          ? "2"
                                                 : "24",
                                "--each"},
                  .pinned = false,
                  .rows = StackRows});
  for (const char* folder : {"/regimes", "/score"}) {
    for (const std::string& file : FilesIn(sources.scenes + folder)) {
      jobs.push_back(SceneJob(file, kCharted, sources.runs > 0 ? sources.runs : small ? 4 : 100));
    }
  }
  AddSweeps(jobs, sources.scenes, kSwept, sources.runs > 0 ? sources.runs : small ? 20 : 100);
  return jobs;
}

std::vector<EvidenceJob> EvidenceJobs(Counts counts, const EvidenceSources& sources) {
  std::vector<EvidenceJob> jobs = TimingJobs(counts);
  std::vector<EvidenceJob> more = AutofocusJobs(counts, sources);
  std::move(more.begin(), more.end(), std::back_inserter(jobs));
  return jobs;
}

}  // namespace lensd::bench
