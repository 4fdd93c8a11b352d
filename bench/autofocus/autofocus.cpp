#include "bench/autofocus/autofocus.h"

#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <vector>

#include "autofocus/session.h"
#include "bench/autofocus/chart.h"
#include "bench/autofocus/runs.h"
#include "bench/autofocus/summary.h"
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
  bool as_json = false;
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
  if (asked != "all") return {asked};
  const auto names = autofocus::MethodNames();
  return {names.begin(), names.end()};
}

ordered_json JsonOf(const AutofocusSummary& summary) {
  const auto number = [](const std::optional<double>& value) { return value ? ordered_json(*value) : ordered_json(); };
  return {{"method", summary.method},
          {"runs", summary.runs},
          {"within", summary.within},
          {"withinLow", summary.within_low},
          {"falseFocus", summary.false_focus},
          {"refused", summary.refused},
          {"framesP50", summary.frames_p50},
          {"framesP95", summary.frames_p95},
          {"movesP50", summary.moves_p50},
          {"movesP95", summary.moves_p95},
          {"elapsedMsP50", summary.elapsed_ms_p50},
          {"elapsedMsP95", summary.elapsed_ms_p95},
          {"errorDofP50", number(summary.error_dof_p50)},
          {"errorDofP95", number(summary.error_dof_p95)},
          {"errorDofMax", number(summary.error_dof_max)},
          {"cpuMsPerFrame", summary.cpu_ms_per_frame},
          {"cpuMsPerVgaFrame", summary.cpu_ms_per_whole_frame},
          {"rmsErrorPx", number(summary.rms_error_px)},
          {"rmsFloorPx", number(summary.rms_floor_px)}};
}

void PrintTable(const std::vector<AutofocusSummary>& summaries) {
  std::printf("%-16s %6s %8s %8s %8s %8s %12s %12s %14s %22s %16s %14s\n", "method", "runs", "within", ">= 95 %",
              "false", "refused", "frames", "moves", "ms", "error in DoF", "cpu ms", "rms blur px");
  std::printf("%-16s %6s %8s %8s %8s %8s %12s %12s %14s %22s %16s %14s\n", "", "", "", "", "", "", "p50 / p95",
              "p50 / p95", "p50 / p95", "p50 / p95 / max", "region / VGA", "error / floor");
  for (const AutofocusSummary& s : summaries) {
    std::printf("%-16s %6d %7.2f%% %7.2f%% %7.2f%% %7.2f%% %5.0f /%5.0f %5.0f /%5.0f %6.0f /%6.0f ", s.method.c_str(),
                s.runs, 100 * s.within, 100 * s.within_low, 100 * s.false_focus, 100 * s.refused, s.frames_p50,
                s.frames_p95, s.moves_p50, s.moves_p95, s.elapsed_ms_p50, s.elapsed_ms_p95);
    if (s.error_dof_p50) {
      std::printf("%6.3f /%6.3f /%6.3f", *s.error_dof_p50, *s.error_dof_p95, *s.error_dof_max);
    } else {
      std::printf("%22s", "-");
    }
    std::printf(" %8.3f /%6.3f", s.cpu_ms_per_frame, s.cpu_ms_per_whole_frame);
    if (s.rms_error_px) std::printf(" %6.3f /%6.3f", *s.rms_error_px, *s.rms_floor_px);
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
  if (!scene) return PassOn(std::move(scene));
  auto pictures = sim::Pictures::Create(std::make_shared<const sim::Scene>(*std::move(scene)));
  if (!pictures) return PassOn(std::move(pictures));
  SceneRuns done;
  done.name = std::filesystem::path(path).stem().string();
  if (auto floor = FocusFloor::Create(**pictures))
    done.floor = *std::move(floor);  // none: several subjects, or no light
  for (const std::string& method : MethodsFrom(options.method)) {
    AutofocusRuns wanted{
        .method = method, .runs = options.runs, .seed = options.seed, .f_number_error = options.f_number_error};
    auto runs = RunAutofocus(*pictures, wanted);
    if (!runs) return PassOn(std::move(runs));
    done.methods.emplace_back(method, *std::move(runs));
    // What a frame costs that is all region: one run, on one thread.
    wanted.runs = wanted.threads = 1;
    wanted.whole_frame = true;
    auto whole = RunAutofocus(*pictures, wanted);
    if (!whole) return PassOn(std::move(whole));
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

}  // namespace

int RunAutofocusCommand(int argc, char** argv) {
  CLI::App app(
      "Runs autofocus methods on a scene on stepped clocks, each run from another start with other noise.\n"
      "Errors are in whole depths of field: `within` means at most 0.5, `false` means focused and beyond 1.");
  Options options;
  app.add_option("--scene", options.scenes, "scene file; several make one chart of all")->required();
  app.add_option("--method", options.method, "a method's name, auto, or all")->capture_default_str();
  app.add_option("--runs", options.runs, "runs of each method")->check(CLI::Range(1, 1000000))->capture_default_str();
  app.add_option("--seed", options.seed, "of starts and noise")->capture_default_str();
  app.add_option("--f-number-error", options.f_number_error, "what the lens believes of its f-numbers over the truth")
      ->check(CLI::Range(0.5, 2.0))
      ->capture_default_str();
  app.add_option("--csv", options.csv, "file for one line a run");
  app.add_option("--svg", options.svg, "file for the charts");
  app.add_flag("--json", options.as_json, "one line of JSON instead of the table");
  return ParseThen(app, argc, argv, [&] { return Bench(options); });
}

}  // namespace lensd::bench
