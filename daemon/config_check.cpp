// Everything is read past its mistakes (config.h), the drivers look at their settings, and only then is told what was
// found: where a line is no TOML at all, what else is said of it follows from that, and is left out.
#include "daemon/config_check.h"

#include <sysexits.h>

#include <algorithm>
#include <cstdio>
#include <tuple>
#include <vector>

#include "base/settings_problems.h"
#include "daemon/config/config_faults.h"
#include "daemon/methods/lenses.h"
#include "daemon/state/lens_state_files.h"
#include "rig/refocus.h"

namespace lensd::daemon {
namespace {

bool SamePlace(const Location& one, const Location& other) {
  return one.file == other.file && one.line == other.line;
}

bool Among(const std::vector<Location>& places, const Location& place) {
  return std::ranges::any_of(places, [&](const Location& other) { return SamePlace(other, place); });
}

/// Those that count, in the order of their files and lines. Files that the configuration names come after its own.
std::vector<SettingsProblem> InOrder(const std::vector<SettingsProblem>& problems, const ConfigFaults& faults) {
  std::vector<Location> told;
  std::vector<SettingsProblem> kept;
  std::vector<std::string> files = faults.files;
  for (const SettingsProblem& problem : problems) {
    if (Among(told, problem.where)) continue;
    if (problem.where.line > 0 && Among(faults.no_toml, problem.where)) told.push_back(problem.where);
    kept.push_back(problem);
    if (std::ranges::find(files, problem.where.file) == files.end()) files.push_back(problem.where.file);
  }
  std::ranges::stable_sort(kept, {}, [&](const SettingsProblem& problem) {
    return std::tuple(std::ranges::find(files, problem.where.file) - files.begin(), problem.where.line);
  });
  return kept;
}

/// What starts no refocus, since the lens has not what it takes.
void CheckRefocus(const LensConfig& lens, const drivers::Device& device, SettingsProblems& problems) {
  if (!lens.rig.refocus) return;
  const auto state = device.lens->Read();
  const rig::RefocusMeans means{.thermometer = !state || state->temperature,
                                .filter = device.lens->capabilities().axes[drivers::Axis::Filter].has_value(),
                                .camera = device.camera != nullptr};
  const auto table = lens.table.AsTable()->find("refocus");
  for (const std::string& lacks : rig::WhatRefocusLacks(*lens.rig.refocus, means)) {
    problems.Add(table->second.where().Text() + ": lens \"" + lens.name + "\": " + lacks, table->second.where());
  }
}

/// Focus that lensd could not keep, since its position cannot be read.
void CheckKeep(const LensConfig& lens, const drivers::Device& device, SettingsProblems& problems) {
  if (!lens.rig.axes[drivers::Axis::Focus].keep) return;
  const std::string why = rig::WhyFocusIsNotKept(device.lens->capabilities());
  if (why.empty()) return;
  const Location where = lens.table.AsTable()->find("focus")->second.where();
  problems.Add(where.Text() + ": lens \"" + lens.name + "\": " + why, where);
}

/// Places that nobody would remember from one start to the next.
void CheckStarts(const Config& config, SettingsProblems& problems) {
  for (const LensConfig& lens : config.lenses) {
    if (!lens.start_last && lens.start_preset.empty()) continue;
    const Location where = lens.table.AsTable()->find("start")->second.where();
    problems.Add(where.Text() + ": lens \"" + lens.name +
                     "\": start: without a state folder neither presets nor the last place outlive lensd: start lensd "
                     "with --state DIR, and name it here too",
                 where);
  }
}

/// What would keep a lens waiting that is configured well.
std::vector<std::string> OpenLenses(const Config& config, const ConfigFaults& faults, const Clock& clock,
                                    SettingsProblems& problems) {
  std::vector<std::string> waiting;
  for (const LensConfig& lens : config.lenses) {
    if (!CheckSettings(lens) || lens.device.driver == nullptr || Among(faults.lenses, lens.where)) continue;
    const auto opened = OpenDevice(lens, clock);
    if (opened) {
      CheckRefocus(lens, *opened, problems);
      CheckKeep(lens, *opened, problems);
      for (const drivers::LeftOut& one : opened->findings.left_out()) {
        waiting.push_back(lens.where.Text() + ": lens \"" + lens.name + "\": " + one.part +
                          " is left out: " + one.reason);
      }
      continue;
    }
    if (opened.error().code == Code::BadData) {
      problems.Add(opened.error().message, lens.where);
    } else {
      waiting.push_back(opened.error().message + " (lensd would wait for it)");
    }
  }
  return waiting;
}

/// Files that lensd would leave unused, and say so only once it runs.
void CheckCalibrations(const Config& config, SettingsProblems& problems) {
  for (const LensConfig& lens : config.lenses) {
    if (!lens.rig.calibration_path) continue;
    if (auto good = CheckNamedCalibration(*lens.rig.calibration_path); !good) {
      problems.Add(good.error().message, lens.where);
    }
  }
}

std::string Summary(const std::string& path, const Config& config) {
  std::string names;
  for (const LensConfig& lens : config.lenses) names += (names.empty() ? " (" : ", ") + lens.name;
  const std::size_t count = config.lenses.size();
  const std::string lenses = count == 0 ? "no lens" : std::to_string(count) + (count == 1 ? " lens" : " lenses");
  return path + " is valid: " + lenses + (names.empty() ? "" : names + ")");
}

}  // namespace

int CheckConfiguration(const std::string& path, const std::string& state, const Clock& clock) {
  SettingsProblems problems;
  ConfigFaults faults;
  const Config config = ReadPastFaults(path, faults);
  const std::vector<std::string> waiting = OpenLenses(config, faults, clock, problems);
  if (state.empty()) CheckStarts(config, problems);
  CheckCalibrations(config, problems);
  const std::vector<SettingsProblem> found = InOrder(problems.all(), faults);
  for (const SettingsProblem& problem : found) std::fprintf(stderr, "%s\n", problem.message.c_str());
  if (!found.empty()) return EX_CONFIG;
  for (const std::string& warning : waiting) std::fprintf(stderr, "%s\n", warning.c_str());
  const bool printed = std::printf("%s\n", Summary(path, config).c_str()) >= 0 && std::fflush(stdout) == 0;
  return printed ? EX_OK : EX_IOERR;
}

}  // namespace lensd::daemon
