// Evidence as CSV and JSON. Values are kept to six digits: what is beyond them differs from run to run.
#include "bench/evidence/rows.h"

#include <sys/utsname.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <thread>

#include "bench/evidence/csv.h"

namespace lensd::bench {
namespace {

namespace fs = std::filesystem;

constexpr std::array kColumns = {"family",   "scene", "method", "role",    "sweep",    "value",   "measure",
                                 "unit",     "n",     "middle", "low",     "high",     "samples", "note",
                                 "settings", "seed",  "commit", "machine", "compiler", "date"};

std::string TextOf(double value) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, value, std::chars_format::general, 6);
  return {text, end.ptr};
}

double NumberFrom(const std::string& text) {
  if (text == "inf") return std::numeric_limits<double>::infinity();
  double value = std::numeric_limits<double>::quiet_NaN();
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

std::vector<std::string> CellsFor(const EvidenceRow& row) {
  std::string samples;
  for (const double sample : row.samples) samples += (samples.empty() ? "" : " ") + TextOf(sample);
  return {row.family,
          row.scene,
          row.method,
          row.role,
          row.sweep,
          row.value ? TextOf(*row.value) : "",
          row.measure,
          row.unit,
          std::to_string(row.n),
          TextOf(row.estimate.middle),
          TextOf(row.estimate.low),
          TextOf(row.estimate.high),
          samples,
          row.note,
          row.settings,
          row.seed,
          row.made.commit,
          row.made.machine,
          row.made.compiler,
          row.made.date};
}

EvidenceRow RowFrom(const std::vector<std::string>& cells) {
  EvidenceRow row{.family = cells[0],
                  .scene = cells[1],
                  .method = cells[2],
                  .role = cells[3],
                  .sweep = cells[4],
                  .measure = cells[6],
                  .unit = cells[7],
                  .n = static_cast<int>(NumberFrom(cells[8])),
                  .estimate = {NumberFrom(cells[9]), NumberFrom(cells[10]), NumberFrom(cells[11])},
                  .note = cells[13],
                  .settings = cells[14],
                  .seed = cells[15],
                  .made = {cells[16], cells[17], cells[18], cells[19]}};
  if (!cells[5].empty()) row.value = NumberFrom(cells[5]);
  for (std::size_t at = 0; at < cells[12].size();) {
    const std::size_t end = std::min(cells[12].find(' ', at), cells[12].size());
    row.samples.push_back(NumberFrom(cells[12].substr(at, end - at)));
    at = end + 1;
  }
  return row;
}

std::string CompilerOfThis() {
#ifdef __clang__
  const std::string name = "clang " __clang_version__;
#else
  const std::string name = "GCC " __VERSION__;
#endif
#ifdef NDEBUG
  return name + ", release";
#else
  return name + ", debug";
#endif
}

/// Of the sources below the working folder, which are those of this program where it is run as documents say.
std::string CommitHere() {
  std::string commit;
  if (FILE* git = ::popen("git describe --always --dirty --exclude='*' 2>/dev/null", "r")) {
    std::array<char, 64> line{};
    if (std::fgets(line.data(), line.size(), git) != nullptr) commit = line.data();
    ::pclose(git);
  }
  while (commit.ends_with('\n')) commit.pop_back();
  return commit.empty() ? "unknown" : commit;
}

std::string ContentsOf(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace

Provenance ProvenanceHere() {
  std::ifstream cpus("/proc/cpuinfo");
  std::string line, model = "unknown processor";
  while (std::getline(cpus, line)) {
    if (!line.starts_with("model name")) continue;
    model = line.substr(line.find(':') + 2);
    break;
  }
  utsname name{};
  uname(&name);
  const std::time_t now = std::time(nullptr);
  std::array<char, 16> date{};
  std::strftime(date.data(), date.size(), "%Y-%m-%d", std::localtime(&now));
  return {.commit = CommitHere(),
          .machine = model + " x" + std::to_string(std::thread::hardware_concurrency()) + " " + name.sysname + " " +
                     name.release,
          .compiler = CompilerOfThis(),
          .date = date.data()};
}

EvidenceRow ShareRow(EvidenceRow like, std::string measure, int hits, int runs) {
  like.measure = std::move(measure);
  like.unit = "share";
  like.n = runs;
  like.estimate = ShareOf(hits, runs);
  return like;
}

EvidenceRow MedianRow(EvidenceRow like, std::string measure, std::string unit, std::vector<double> samples) {
  like.measure = std::move(measure);
  like.unit = std::move(unit);
  like.n = static_cast<int>(samples.size());
  like.estimate = MedianOf(samples);
  like.samples = std::move(samples);
  return like;
}

std::string CsvOf(const std::vector<EvidenceRow>& rows) {
  std::string text;
  for (const char* column : kColumns) text += (text.empty() ? "" : ",") + std::string(column);
  text += '\n';
  for (const EvidenceRow& row : rows) {
    std::string line;
    for (const std::string& cell : CellsFor(row)) line += QuotedCell(cell) + ',';
    line.back() = '\n';
    text += line;
  }
  return text;
}

Result<std::vector<EvidenceRow>> RowsFromCsv(const std::string& text, const std::string& path) {
  const auto lines = CellsOf(text);
  std::vector<EvidenceRow> rows;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const bool names = i == 0;
    if (lines[i].size() != kColumns.size() || (names && !std::ranges::equal(lines[i], kColumns))) {
      return Fail(Code::BadData, path + ":" + std::to_string(i + 1) + ": not a line of evidence; lens-bench evidence " +
                                     "writes them with " + std::to_string(kColumns.size()) + " columns");
    }
    if (!names) rows.push_back(RowFrom(lines[i]));
  }
  return rows;
}

std::string JsonOf(const std::vector<EvidenceRow>& rows) {
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  const auto finite = [](double value) {
    return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json();
  };
  for (const EvidenceRow& row : rows) {
    nlohmann::ordered_json samples = nlohmann::ordered_json::array();
    for (const double sample : row.samples) samples.push_back(finite(sample));
    const auto cells = CellsFor(row);
    nlohmann::ordered_json one;
    for (std::size_t i = 0; i < kColumns.size(); ++i) one[kColumns[i]] = cells[i];
    one["value"] = row.value ? finite(*row.value) : nlohmann::ordered_json();
    one["n"] = row.n;
    one["middle"] = finite(row.estimate.middle);
    one["low"] = finite(row.estimate.low);
    one["high"] = finite(row.estimate.high);
    one["samples"] = std::move(samples);
    all.push_back(std::move(one));
  }
  return all.dump() + "\n";
}

Result<std::vector<EvidenceRow>> LoadEvidence(const std::string& directory) {
  std::vector<fs::path> paths;
  std::error_code trouble;
  for (fs::recursive_directory_iterator entry(directory, trouble), end; !trouble && entry != end;
       entry.increment(trouble)) {
    if (entry.depth() == 1 && entry->path().extension() == ".csv") paths.push_back(entry->path());
  }
  if (trouble) return Fail(Code::Io, "cannot read " + directory + ": " + trouble.message());
  std::ranges::sort(paths);
  std::vector<EvidenceRow> all;
  for (const fs::path& path : paths) {
    auto rows = RowsFromCsv(ContentsOf(path), path);
    if (!rows) return PassOn(rows);
    all.insert(all.end(), rows->begin(), rows->end());
  }
  return all;
}

std::string FileNameOf(std::string_view scene) {
  std::string name;
  for (const char c : scene) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
    if (letter)
      name += c;
    else if (c >= 'A' && c <= 'Z')
      name += static_cast<char>(c - 'A' + 'a');
    else if (!name.empty() && name.back() != '-')
      name += '-';
  }
  while (name.ends_with('-')) name.pop_back();
  return name;
}

}  // namespace lensd::bench
