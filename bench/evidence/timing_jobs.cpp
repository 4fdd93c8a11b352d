// Jobs of the families that are timed: plan, measure, render, rpc, drivers and move. Each process prints one table; a
// method's times of all processes, in their order, are its samples, so that ratios can be taken process by process.
#include "bench/evidence/timing_jobs.h"

#include <cmath>
#include <limits>
#include <map>

namespace lensd::bench {
namespace {

using nlohmann::json;
using Rows = std::vector<EvidenceRow>;
using Answers = std::vector<json>;

double NumberOf(const json& row, const char* key) {
  return row.contains(key) && row[key].is_number() ? row[key].get<double>() : std::numeric_limits<double>::infinity();
}

/// The same figure of the same line of every answer.
std::vector<double> SamplesOf(const Answers& answers, std::size_t line, const char* key) {
  std::vector<double> samples;
  for (const json& answer : answers) samples.push_back(NumberOf(answer.at(line), key));
  return samples;
}

/// A figure that no repeat changes.
EvidenceRow FixedRow(const EvidenceRow& like, std::string measure, std::string unit, double value) {
  EvidenceRow row = MedianRow(like, std::move(measure), std::move(unit), {value});
  row.samples.clear();
  return row;
}

Rows PlanRows(const EvidenceRow& like, const Answers& answers) {
  Rows rows;
  for (std::size_t i = 0; i < answers.front().size(); ++i) {
    const json& line = answers.front()[i];
    EvidenceRow row = like;
    row.scene = line["set"];
    row.method = line["method"];
    row.role = row.method == "lensd" ? "ours" : row.method == "reading the numbers once" ? "floor" : "peer";
    rows.push_back(MedianRow(row, "time", "us", SamplesOf(answers, i, "timeUsP50")));
    if (!line.contains("errorMax")) continue;
    const int problems = line["problems"];
    rows.push_back(FixedRow(row, "error", "of the f-number", line["errorMax"]));
    rows.push_back(ShareRow(row, "wrong", line["wrong"], problems));
    rows.push_back(ShareRow(row, "over", line["over"], problems));
    if (line["refused"] > 0 || row.scene.starts_with("regime"))
      rows.push_back(ShareRow(row, "refused", line["refused"], problems));
  }
  return rows;
}

Rows NeedRows(const EvidenceRow& like, const Answers& answers) {
  Rows rows;
  for (const json& line : answers.front()) {
    EvidenceRow row = like;
    row.scene = "need: " + line["plan"].get<std::string>();
    row.method = "lensd";
    row.note = line["models"];
    const int problems = line["problems"];
    rows.push_back(ShareRow(row, "simpler would do", line["simpler"], problems));
    rows.push_back(ShareRow(row, "not enough", line["beyond"], problems));
    rows.push_back(FixedRow(row, "model error", "um", line["errorUm"]));
    rows.push_back(FixedRow(row, "model bound", "um", line["boundUm"]));
    rows.push_back(FixedRow(row, "model tolerance", "um", line["toleranceUm"]));
    rows.push_back(FixedRow(row, "time, chosen model", "us", line["chosenUs"]));
    rows.push_back(FixedRow(row, "time, heaviest model", "us", line["heaviestUs"]));
  }
  return rows;
}

Rows MeasureRows(const EvidenceRow& like, const Answers& answers) {
  Rows rows;
  for (std::size_t i = 0; i < answers.front().size(); ++i) {
    const json& line = answers.front()[i];
    EvidenceRow row = like;
    row.method = line["measure"];
    row.role = row.method == "read memory once" ? "floor" : line["peer"].get<bool>() ? "peer" : "ours";
    rows.push_back(MedianRow(row, "time", "ms", SamplesOf(answers, i, "elapsedMs")));
  }
  return rows;
}

Rows RenderRows(const EvidenceRow& like, const Answers& answers) {
  Rows rows;
  for (std::size_t i = 0; i < answers.front().size(); ++i) {
    const json& line = answers.front()[i];
    EvidenceRow row = like;
    const std::string renderer = line["renderer"];
    const bool chosen = renderer.starts_with("auto (");
    row.method = chosen ? "auto" : renderer;
    if (chosen) row.note = renderer.substr(6, renderer.size() - 7);
    if (line["rays"].is_number()) row.method += " " + line["rays"].dump();
    row.role = line["peer"].get<bool>() ? "peer" : renderer == "copy once" ? "floor" : "ours";
    if (const std::string scene = line["scene"]; !scene.empty()) row.scene = scene;
    if (line["family"] == "one disk") {
      row.sweep = "disk diameter [px]";
      row.value = line["diameterPx"].get<double>();
    }
    rows.push_back(MedianRow(row, "time", "ms", SamplesOf(answers, i, "elapsedMs")));
    double error = 0.0;
    for (const char* part : {"interiorErrorLevels", "boundaryErrorLevels"}) {
      if (line[part].is_number()) error = std::max(error, line[part].get<double>());
    }
    if (row.role != "floor") rows.push_back(FixedRow(row, "error", "of 255", error));
    if (line.contains("boundLevels") && line["boundLevels"].is_number()) {
      rows.push_back(FixedRow(row, "bound", "of 255", line["boundLevels"]));
    }
  }
  return rows;
}

Rows RpcRows(const EvidenceRow& like, const Answers& answers) {
  Rows rows;
  for (std::size_t i = 0; i < answers.front().size(); ++i) {
    const json& line = answers.front()[i];
    EvidenceRow row = like;
    row.method = line["way"];
    const bool ours =
        row.method.starts_with("lensd") || row.method.starts_with("the plan") || row.method.starts_with("Status");
    row.role = line["peer"].get<bool>() ? "peer" : ours ? "ours" : "floor";
    for (const auto& [measure, key] : {std::pair{"time", "roundTripUsP50"},
                                       {"time, 95 % of calls", "roundTripUsP95"},
                                       {"time, 99.9 % of calls", "roundTripUsP999"}}) {
      if (!line.contains(key)) continue;
      rows.push_back(MedianRow(row, measure, "us", SamplesOf(answers, i, key)));
    }
  }
  return rows;
}

/// A step is the same every time: the simulator and the clock are its own.
Rows MoveRows(const EvidenceRow& like, const Answers& answers) {
  Rows rows;
  for (const json& line : answers.front()) {
    EvidenceRow row = like;
    row.method = line["method"];
    row.role = row.method == "raw" || row.method == "fixed-wait" ? "peer" : "ours";
    row.sweep = "error of the frequency [%]";
    row.value = line["frequencyErrorPercent"].get<double>();
    rows.push_back(FixedRow(row, "residual after 0.75 periods", "of the step", line["residualAt075"]));
    rows.push_back(FixedRow(row, "residual after 1 period", "of the step", line["residualAt1"]));
    rows.push_back(FixedRow(row, "time to 5 %", "periods", NumberOf(line, "periodsTo5Percent")));
  }
  return rows;
}

Rows DriverRows(const EvidenceRow& like, const Answers& answers) {
  Rows rows;
  for (std::size_t i = 0; i < answers.front().size(); ++i) {
    const json& line = answers.front()[i];
    EvidenceRow row = like;
    row.method = line["driver"];
    row.role = line["floor"].get<bool>() ? "floor" : "ours";
    if (line["sweep"].is_null()) {
      // Half of the calls take less; of what is told nearly all has to be true.
      const char* key = line["measure"] == "error" ? "p95" : "p50";
      rows.push_back(MedianRow(row, line["measure"], line["unit"], SamplesOf(answers, i, key)));
      continue;
    }
    row.sweep = line["sweep"];
    row.value = line["value"].get<double>();
    for (const char* how : {"within", "verified", "refused", "false"}) {
      rows.push_back(ShareRow(row, how, line[how], line["n"]));
    }
    rows.push_back(FixedRow(row, "move", "ms", line["p50"]));
  }
  return rows;
}

}  // namespace

std::vector<EvidenceJob> TimingJobs(Counts counts) {
  const bool quick = counts == Counts::Quick;
  const int repeats = quick ? 3 : counts == Counts::Small ? 9 : 25;
  std::vector<EvidenceJob> jobs;
  const auto add = [&](const char* family, const char* scene, std::vector<std::string> arguments, int times,
                       decltype(EvidenceJob::rows) rows) {
    jobs.push_back({.family = family,
                    .scene = scene,
                    .arguments = std::move(arguments),
                    .repeats = times,
                    .rows = std::move(rows)});
  };
  add("move", "voice coil", {"--points", quick ? "3" : "21"}, 1, MoveRows);
  add("measure", "1080p, 8 bits", {"--repeats", quick ? "5" : "31"}, repeats, MeasureRows);
  // A round trip is mostly the machine's scheduler, which a guard on a busy machine cannot judge.
  if (!quick) add("rpc", "one client", {"--rounds", counts == Counts::Small ? "2000" : "20000"}, repeats, RpcRows);
  const auto of = [&](const char* at_quick, const char* at_small, const char* at_long) {
    return std::string(quick ? at_quick : counts == Counts::Small ? at_small : at_long);
  };
  add("plan", "regimes", {"--regimes", of("60", "300", "2000"), "--rounds", "1"}, 1, PlanRows);
  add("plan", "models", {"--needs", of("20", "100", "1000")}, 1, NeedRows);
  if (!quick) add("drivers", "calls and moves", {"--only", "speed"}, repeats, DriverRows);
  add("drivers", "weather", {"--only", "weather", "--moves", of("5", "40", "100")}, 1, DriverRows);
  add("plan", "limits and depths",
      quick ? std::vector<std::string>{"--quick", "--rounds", "1"} : std::vector<std::string>{"--rounds", "1"}, repeats,
      PlanRows);
  const std::vector<std::string> disks =
      quick ? std::vector<std::string>{"--only", "disks", "--repeats", "1", "--width", "640", "--height", "480"}
            : std::vector<std::string>{"--only", "disks", "--repeats", counts == Counts::Small ? "1" : "3"};
  add("render", "one disk", disks, repeats, RenderRows);
  if (quick) return jobs;
  add("render", "varying disk", {"--only", "varying", "--repeats", "1"}, repeats, RenderRows);
  add("render", "scenes", {"--only", "scenes"}, counts == Counts::Small ? 1 : 9, RenderRows);
  return jobs;
}

}  // namespace lensd::bench
