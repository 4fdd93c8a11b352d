// The command `autofocus`: runs of every method asked for over every scene, a table, CSV, JSON and charts.
#include "bench/autofocus/autofocus.h"

#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <vector>

#include "autofocus/session.h"
#include "bench/autofocus/chart.h"
#include "bench/autofocus/recording.h"
#include "bench/autofocus/replay.h"
#include "bench/autofocus/run_json.h"
#include "bench/autofocus/runs.h"
#include "bench/autofocus/summary.h"
#include "bench/autofocus/variations.h"
#include "bench/command.h"
#include "io/svg.h"
#include "sim/scene.h"

namespace lensd::bench {
namespace {

using nlohmann::ordered_json;

struct Options {
  std::vector<std::string> scenes;
  std::string method = "auto", csv, svg;
  int runs = 100;
  std::uint64_t seed = 1;
  double f_number_error = 1.0;
  int learn = 0;
  double other_lens = 1.0;
  bool draw_distance = false;
  bool track = false;
  bool as_json = false;
  std::string replay, only, without;
  int starts = 6;
  double gamma = 2.2;
  bool crop = false;
  std::string vary;   ///< "NAME=VALUE"
  bool each = false;  ///< every run in the JSON, too
};

int Complain(const Error& error, int status) {
  std::cerr << "lens-bench autofocus: " << error.message << "\n";
  return status;
}

int StatusOf(Code code) {
  if (code == Code::BadData) return EX_DATAERR;
  if (code == Code::Io) return EX_IOERR;
  if (code == Code::InvalidArgument) return EX_USAGE;
  return EX_SOFTWARE;
}

std::vector<std::string> MethodsFrom(const std::string& asked) {
  if (asked == "all") {
    const auto names = autofocus::MethodNames();
    return {names.begin(), names.end()};
  }
  std::vector<std::string> methods;
  std::istringstream list(asked);
  for (std::string method; std::getline(list, method, ',');) methods.push_back(method);
  return methods;
}

void PrintTable(const std::vector<AutofocusSummary>& summaries) {
  std::printf("%-16s %6s %8s %8s %8s %8s %12s %12s %22s %22s %16s %14s %9s\n", "method", "runs", "within", ">= 95 %",
              "false", "refused", "frames", "moves", "ms waited", "error in DoF", "cpu ms", "rms blur px", "95 % hold");
  std::printf("%-16s %6s %8s %8s %8s %8s %12s %12s %22s %22s %16s %14s %9s\n", "", "", "", "", "", "", "p50 / p95",
              "p50 / p95", "p50 / p95 / x floor", "p50 / p95 / max", "region / VGA", "error / floor", "of claims");
  for (const AutofocusSummary& s : summaries) {
    std::printf("%-16s %6d %7.2f%% %7.2f%% %7.2f%% %7.2f%% %5.0f /%5.0f %5.0f /%5.0f %6.0f /%6.0f /%5.2f ",
                s.method.c_str(), s.runs, 100 * s.within, 100 * s.within_low, 100 * s.false_focus, 100 * s.refused,
                s.frames_p50, s.frames_p95, s.moves_p50, s.moves_p95, s.waited_ms_p50, s.waited_ms_p95,
                s.times_known_p50);
    if (s.error_dof_p50) {
      std::printf("%6.3f /%6.3f /%6.3f", *s.error_dof_p50, *s.error_dof_p95, *s.error_dof_max);
    } else {
      std::printf("%22s", "-");
    }
    std::printf(" %8.3f /%6.3f", s.cpu_ms_per_frame, s.cpu_ms_per_whole_frame);
    if (s.rms_error_px) std::printf(" %6.3f /%6.3f", *s.rms_error_px, *s.rms_floor_px);
    if (s.claim_holds) std::printf(" %7.1f %%", 100 * *s.claim_holds);
    std::printf("\n");
  }
}

Result<void> WriteCsv(const std::string& path, const std::vector<SceneRuns>& scenes) {
  std::ofstream file(path);
  file << "scene,method,run,startSteps,endSteps,focused,frames,moves,elapsedMs,cpuMs,errorD,halfDofD,errorDof,reason\n";
  file.precision(17);
  const auto ms = [](Duration duration) { return std::chrono::duration<double, std::milli>(duration).count(); };
  for (const SceneRuns& scene : scenes) {
    for (const auto& [method, runs] : scene.methods) {
      for (std::size_t i = 0; i < runs.size(); ++i) {
        const AutofocusRunResult& run = runs[i];
        file << scene.name << ',' << method << ',' << i << ',' << run.start_steps << ',' << run.end_steps << ','
             << run.focused << ',' << run.frames << ',' << run.moves << ',' << ms(run.elapsed) << ',' << ms(run.cpu)
             << ',' << run.error_d << ',' << run.half_dof_d << ',' << run.error_dof() << ",\"" << run.reason << "\"\n";
      }
    }
  }
  file.flush();
  if (!file) return Fail(Code::Io, "cannot write " + path);
  return {};
}

Result<SceneRuns> RunScene(const std::string& path, const Options& options) {
  auto scene = sim::LoadScene(path);
  if (!scene) return PassOn(scene);
  AutofocusRuns like{.runs = options.runs, .seed = options.seed, .f_number_error = options.f_number_error};
  if (!options.vary.empty()) {
    if (auto varied = Vary(options.vary, *scene, like); !varied) return PassOn(varied);
  }
  auto pictures = sim::Pictures::Create(std::make_shared<const sim::Scene>(*std::move(scene)));
  if (!pictures) return PassOn(pictures);
  SceneRuns done;
  done.name = std::filesystem::path(path).stem().string();
  if (options.draw_distance) like.distance = SubjectDistance::DrawnAnew;
  like.after = options.track ? AfterAnswer::Track : AfterAnswer::End;
  // None where there are several subjects, or no light; and it is worked out for one place of the subject.
  if (auto floor = FocusFloor::Create(**pictures); floor && !options.draw_distance) done.floor = *std::move(floor);
  for (const std::string& method : MethodsFrom(options.method)) {
    AutofocusRuns wanted = like;
    wanted.method = method;
    auto slope = LearnedFrom(*pictures, wanted, options.learn);
    if (!slope) return PassOn(slope);
    wanted.slope = *slope;
    if (wanted.slope) wanted.slope->log_factor += std::log(options.other_lens);
    auto runs = RunAutofocus(*pictures, wanted);
    if (!runs) return PassOn(runs);
    done.methods.emplace_back(method, *std::move(runs));
    if (options.each) {
      done.cpu_ms_per_vga_frame.push_back(0.0);  // not asked
      continue;
    }
    // What a frame costs that is all region: one run, on one thread.
    wanted.runs = wanted.threads = 1;
    wanted.whole_frame = true;
    auto whole = RunAutofocus(*pictures, wanted);
    if (!whole) return PassOn(whole);
    const double pixels = static_cast<double>((*pictures)->scene().camera.width) * (*pictures)->scene().camera.height;
    done.cpu_ms_per_vga_frame.push_back(CpuMsPerFrame(*whole) * 640.0 * 480.0 / pixels);
  }
  return done;
}

int Bench(const Options& options) {
  std::vector<SceneRuns> scenes;
  ordered_json rows = ordered_json::array();
  for (const std::string& path : options.scenes) {
    auto scene = RunScene(path, options);
    if (!scene) return Complain(scene.error(), StatusOf(scene.error().code));
    std::vector<AutofocusSummary> summaries;
    for (const auto& [method, runs] : scene->methods) {
      summaries.push_back(Summarise(method, runs, scene->floor ? &*scene->floor : nullptr));
      summaries.back().cpu_ms_per_whole_frame = scene->cpu_ms_per_vga_frame[summaries.size() - 1];
      rows.push_back(JsonOf(summaries.back()));
      if (options.scenes.size() > 1) rows.back()["scene"] = scene->name;
      if (options.each) rows.back()["each"] = EachOf(runs, scene->floor ? &*scene->floor : nullptr);
    }
    if (!options.as_json && options.scenes.size() > 1) std::printf("%s\n", scene->name.c_str());
    if (!options.as_json) PrintTable(summaries);
    scenes.push_back(*std::move(scene));
  }
  if (!options.csv.empty()) {
    if (auto written = WriteCsv(options.csv, scenes); !written) return Complain(written.error(), EX_IOERR);
  }
  if (!options.svg.empty()) {
    auto written = io::WriteSvg(options.svg, AutofocusChart(scenes));
    if (!written) return Complain(written.error(), EX_IOERR);
  }
  if (options.as_json) std::cout << rows.dump() << "\n";
  return EX_OK;
}

struct ReplayTally {
  int runs = 0, within = 0, off = 0, wrong = 0, refused = 0;
  int in_two_sigma = 0, answers = 0;  ///< of one depth
  std::vector<double> frames;
};

std::map<std::string, ReplayTally> TallyOf(const std::vector<ReplayRun>& runs) {
  std::map<std::string, ReplayTally> tallies;
  for (const ReplayRun& run : runs) {
    for (const std::string& row : {run.region.kind, run.stack + ", " + run.region.kind}) {
      ReplayTally& tally = tallies[row];
      ++tally.runs;
      tally.within += run.how == ReplayEnd::Within;
      tally.off += run.how == ReplayEnd::Off;
      tally.wrong += run.how == ReplayEnd::False;
      tally.refused += run.how == ReplayEnd::Refused;
      tally.frames.push_back(run.frames);
      if (run.how == ReplayEnd::Refused || run.region.kind != "one depth") continue;
      ++tally.answers;
      tally.in_two_sigma += std::abs(run.end - run.region.best) <= 1.96 * run.sigma;
    }
  }
  return tallies;
}

Result<void> WriteReplayCsv(const std::string& path, const std::vector<ReplayRun>& runs) {
  constexpr const char* kEnds[] = {"within", "off", "false", "refused"};
  std::ofstream file(path);
  file << "stack,kind,x,y,width,height,best,start,end,sigma,offPx,frames,outcome,method,reason\n";
  for (const ReplayRun& run : runs) {
    const drivers::Region& roi = run.region.region;
    file << run.stack << ',' << run.region.kind << ',' << roi.x << ',' << roi.y << ',' << roi.width << ',' << roi.height
         << ',' << run.region.best << ',' << run.start << ',' << run.end << ',' << run.sigma << ',' << run.off_px << ','
         << run.frames << ',' << kEnds[static_cast<int>(run.how)] << ',' << run.method << ",\"" << run.reason << "\"\n";
  }
  file.flush();
  if (!file) return Fail(Code::Io, "cannot write " + path);
  return {};
}

/// A run that lensctl recorded: its truth is not known, so what the methods say is put side by side.
int BenchRecording(const Options& options) {
  if (!options.csv.empty()) {
    std::cerr << "lens-bench autofocus: --csv is of stacks and scenes; --json prints what a recorded run comes to\n";
    return EX_USAGE;
  }
  auto recorded = LoadRun(options.replay);
  if (!recorded) return Complain(recorded.error(), StatusOf(recorded.error().code));
  if (!options.as_json) {
    std::printf("recorded: %zu frames, %s by %s\n%-16s %-8s %14s %12s %7s %10s  %s\n", recorded->frames.size(),
                recorded->focused ? "focused" : "refused", recorded->method.c_str(), "method", "focused",
                ("at (" + recorded->unit + ")").c_str(), "sigma", "frames", "elsewhere", "reason");
  }
  ordered_json rows = ordered_json::array();
  for (const std::string& method : MethodsFrom(options.method)) {
    if (options.method == "all" && method == "moving") continue;  // a recording cannot show a lens in motion
    auto run = ReplayOf(*recorded, method);
    if (!run) return Complain(run.error(), StatusOf(run.error().code));
    const autofocus::Verdict& verdict = run->verdict;
    rows.push_back({{"method", method},
                    {"by", run->method},
                    {"focused", verdict.focused},
                    {"at", run->end},
                    {"unit", recorded->unit},
                    {"sigma", verdict.focused ? ordered_json(verdict.sigma) : ordered_json()},
                    {"frames", run->frames},
                    {"elsewhere", run->elsewhere},
                    {"reason", verdict.reason}});
    if (options.as_json) continue;
    std::printf("%-16s %-8s %14.6g %12.3g %7d %10d  %s\n", method.c_str(), verdict.focused ? "yes" : "no", run->end,
                verdict.sigma, run->frames, run->elsewhere, verdict.reason.c_str());
  }
  if (options.as_json) std::cout << rows.dump() << "\n";
  return EX_OK;
}

/// Recorded stacks instead of scenes.
int BenchReplay(const Options& options) {
  auto stacks = LoadStacks(options.replay, options.gamma);
  if (!stacks) return Complain(stacks.error(), StatusOf(stacks.error().code));
  std::erase_if(*stacks, [&](const Stack& stack) {
    return stack.name == options.without || (!options.only.empty() && stack.name != options.only);
  });
  ordered_json rows = ordered_json::array();
  std::vector<ReplayRun> all;
  for (const std::string& method : MethodsFrom(options.method)) {
    if (method == "moving") continue;  // a stack cannot show a lens in motion
    auto runs = Replay(*stacks, {.method = method,
                                 .starts = options.starts,
                                 .crop = options.crop,
                                 .slope_error = 1.0 / options.f_number_error,
                                 .learn = options.learn > 0,
                                 .other_lens = options.other_lens});
    if (!runs) return Complain(runs.error(), StatusOf(runs.error().code));
    if (!options.as_json) {
      std::printf("%-16s %-28s %5s %8s %5s %6s %8s %12s %12s\n", "method", "regions", "runs", "within", "off", "false",
                  "refused", "frames", "in 95 %");
    }
    for (const auto& [row, tally] : TallyOf(*runs)) {
      const double p50 = Percentile(tally.frames, 0.5), p95 = Percentile(tally.frames, 0.95);
      rows.push_back({{"method", method},
                      {"regions", row},
                      {"runs", tally.runs},
                      {"within", tally.within},
                      {"off", tally.off},
                      {"false", tally.wrong},
                      {"refused", tally.refused},
                      {"framesP50", p50},
                      {"framesP95", p95},
                      {"answers", tally.answers},
                      {"inside95", tally.in_two_sigma}});
      if (options.each) rows.back()["each"] = {{"frames", tally.frames}};
      if (options.as_json) continue;
      std::printf("%-16s %-28s %5d %8d %5d %6d %8d %5.0f /%5.0f", method.c_str(), row.c_str(), tally.runs, tally.within,
                  tally.off, tally.wrong, tally.refused, p50, p95);
      if (tally.answers > 0) std::printf(" %11.1f%%", 100.0 * tally.in_two_sigma / tally.answers);
      std::printf("\n");
    }
    all.insert(all.end(), runs->begin(), runs->end());
  }
  if (!options.csv.empty()) {
    if (auto written = WriteReplayCsv(options.csv, all); !written) return Complain(written.error(), EX_IOERR);
  }
  if (options.as_json) std::cout << rows.dump() << "\n";
  return EX_OK;
}

}  // namespace

int RunAutofocusCommand(int argc, char** argv) {
  CLI::App app(
      "Runs autofocus methods on a scene on stepped clocks, each run from another start with other noise.\n"
      "Errors are in whole depths of field: `within` means at most 0.5, `false` means focused and beyond 1.");
  Options options;
  app.add_option("--scene", options.scenes, "scene file; several make one chart of all");
  app.add_option("--replay", options.replay,
                 "instead of scenes: folder of recorded focal stacks (stacks.json), or of one run that `lensctl "
                 "autofocus --record` kept (run.json); the run begins at its first frame");
  app.add_option("--starts", options.starts, "with --replay: starts of each region")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--stack", options.only, "with --replay: this stack alone");
  app.add_option("--without", options.without, "with --replay: all stacks but this one");
  app.add_option("--gamma", options.gamma, "with --replay: of the recorded pictures")
      ->check(CLI::Range(0.2, 5.0))
      ->capture_default_str();
  app.add_flag("--crop", options.crop, "with --replay: show the region alone instead of the whole frame");
  app.add_option("--method", options.method, "a method's name, auto, several with commas between them, or all")
      ->capture_default_str();
  app.add_option("--runs", options.runs, "runs of each method")->check(CLI::Range(1, 1000000))->capture_default_str();
  app.add_option("--seed", options.seed, "of starts and noise")->capture_default_str();
  app.add_option("--f-number-error", options.f_number_error, "what the lens believes of its f-numbers over the truth")
      ->check(CLI::Range(0.5, 2.0))
      ->capture_default_str();
  app.add_option(
         "--learn", options.learn,
         "with --scene: runs before these that teach the slope of blur, not scored; with --replay, above 0: what the "
         "stack's other regions have shown is gone by")
      ->check(CLI::Range(0, 1000));
  app.add_option("--other-lens", options.other_lens,
                 "with --learn: it was learned of a lens whose blur grows so many times as fast")
      ->check(CLI::Range(0.2, 5.0));
  app.add_flag("--draw-distance", options.draw_distance,
               "another distance of the subject in every run, over the middle four fifths of the travel; for scenes of "
               "walls alone");
  app.add_flag("--track", options.track,
               "searches that will track, scored by their first answer: the subject may move");
  app.add_option("--vary", options.vary, "NAME=VALUE: the scene with one difficulty more, backlash=30 for instance");
  app.add_flag("--each", options.each, "with --json: every run as well");
  app.add_option("--csv", options.csv, "file for one line a run");
  app.add_option("--svg", options.svg, "file for the charts");
  app.add_flag("--json", options.as_json, "one line of JSON instead of the table");
  return ParseThen(app, argc, argv, [&] {
    if (options.replay.empty() == options.scenes.empty()) {
      std::cerr << "lens-bench autofocus: give either --scene or --replay, as in --scene scenes/brick.toml\n";
      return EX_USAGE;
    }
    if (options.replay.empty()) return Bench(options);
    return std::filesystem::exists(options.replay + "/run.json") ? BenchRecording(options) : BenchReplay(options);
  });
}

}  // namespace lensd::bench
