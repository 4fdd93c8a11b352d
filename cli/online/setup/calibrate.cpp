// calibrate, backlash.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <sstream>

#include "cli/charts/chart_file.h"
#include "cli/link/arguments.h"
#include "cli/link/daemon_client.h"
#include "cli/link/drive.h"
#include "cli/link/progress.h"
#include "cli/online/autofocus/autofocus.h"
#include "cli/online/commands.h"
#include "cli/online/setup/calibration_plot.h"
#include "cli/text/quantity.h"
#include "cli/text/texts.h"

namespace lensd::cli {
namespace {

using varlink::Json;

struct CalibrateText {
  std::string name;
  std::vector<std::string> targets;  ///< --at
  std::vector<std::string> points;   ///< --point STEPS=DEPTH
  std::string file;
  std::string error;
  int repeat = 3;
  PlotText plot;
  bool data_sheet = false;
  bool show = false;
  bool remove = false;
  bool all = false;
};

std::string CalibrationText(const Json& info) {
  std::string line = info.value("lens", "") + ": " + info.value("grade", "");
  if (info.contains("errorUm") && info["errorUm"].is_number()) {
    line += ", extension within " + NumberText(info, "errorUm", 3, " um");
  }
  const bool kept = info.contains("file") && info["file"].is_string();
  if (info.contains("toml") && info["toml"].is_string()) {
    line += kept ? ", kept in " + info["file"].get<std::string>()
                 : ", not kept: give lensd --state, or calibration = \"FILE\" in [lens.optics]";
  }
  return line;
}

/// What a removal took away and what it left.
std::string RemovalText(const Json& reply) {
  const auto list = [&](const char* key) {
    std::string words;
    for (const Json& part : reply.value(key, Json::array())) {
      words += (words.empty() ? "" : ", ") + part.get<std::string>();
    }
    return words;
  };
  if (!reply.contains("removed") || !reply["removed"].is_array()) return "";
  const std::string removed = list("removed"), kept = list("kept");
  return "; removed: " + (removed.empty() ? "nothing, for there was none" : removed) +
         (kept.empty() ? "" : "; still there: " + kept + " (--all removes them too)");
}

enum class Shows { OneLine, WholeFile };

Outcome Show(Session& session, const Json& reply, const PlotText& plot, Shows shows) {
  const Json& info = reply["calibration"];
  if (plot.wanted()) {
    const auto chart = CalibrationChart(info);
    if (!chart) return PassOn(chart);
    if (auto drawn = WritePlot(plot, io::ChartSvg(*chart)); !drawn) return PassOn(drawn);
  }
  if (session.json()) {
    Json merged = info;
    for (const char* key : {"removed", "kept"}) {
      if (reply.contains(key)) merged[key] = reply[key];
    }
    session.PrintJson(merged);
    return Exit::Done;
  }
  if (shows == Shows::OneLine) {
    session.PrintText(CalibrationText(info) + RemovalText(reply));
    return Exit::Done;
  }
  session.Remark(CalibrationText(info));
  if (info.contains("toml") && info["toml"].is_string()) session.PrintText(info["toml"].get<std::string>());
  return Exit::Done;
}

/// A depth as a field of the interface's CalibrationPoint.
std::expected<Json, Failure> DepthOf(const std::string& text, const std::string& option) {
  if (text.starts_with("ext:")) {
    auto extension = ParseLength(text.substr(4), option);
    if (!extension) return PassOn(extension);
    return Json{{"extensionMm", extension->value * 1e3}};
  }
  auto depth = ParseDepth(text, option);
  if (!depth) return PassOn(depth);
  return Json{{depth->IsDistance() ? "distanceM" : "vergenceD", depth->value}};
}

std::expected<Json, Failure> PointOf(const std::string& text) {
  const auto equals = text.find('=');
  if (equals == std::string::npos) {
    return Refuse(Exit::Usage, "--point '" + text + "': write STEPS=DEPTH, such as 1200=0.8m or 0=inf");
  }
  auto steps = ParseNumber(std::string_view(text).substr(0, equals), "--point");
  if (!steps) return PassOn(steps);
  auto point = DepthOf(text.substr(equals + 1), "--point");
  if (point) (*point)["position"] = *steps->Nearest();
  return point;
}

/// Waits for Enter; a failure where there is no more input.
std::expected<void, Failure> AskFor(Session& session, const std::string& target) {
  session.Remark("Put a target with texture at " + target + ", filling the focus region, and press Enter.");
  std::string line;
  if (!std::getline(std::cin, line)) {
    return Refuse(Exit::NoInput, "no more input: nothing has been changed");
  }
  return {};
}

std::expected<Json, Failure> FocusOnce(Session& session, DaemonClient& link, const Json& lens) {
  return FocusByOwnCamera(session, link, {{"lens", lens}});
}

/// Known targets, autofocus at each, several times from another place.
std::expected<Json, Failure> Guided(Session& session, DaemonClient& link, const CalibrateText& text, const Json& lens) {
  std::vector<Json> depths;
  for (const std::string& target : text.targets) {
    auto depth = DepthOf(target, "--at");
    if (!depth) return depth;
    depths.push_back(*std::move(depth));
  }
  Json points = Json::array();
  for (std::size_t i = 0; i < depths.size(); ++i) {
    if (auto ready = AskFor(session, text.targets[i]); !ready) return PassOn(ready);
    for (int round = 0; round < text.repeat; ++round) {
      auto found = FocusOnce(session, link, lens);
      if (!found) return found;
      if (!found->value("focused", false)) {
        return Refuse(Exit::No, "at " + text.targets[i] + ": autofocus refuses: " + TextOf(*found, "reason") +
                                    "; nothing has been changed");
      }
      Json point = depths[i];
      point["position"] = (*found)["position"];
      points.push_back(point);
      session.Remark("  " + text.targets[i] + ": position " + NumberText(point, "position", 8, "") + " after " +
                     NumberText(*found, "frames", 4, " frames"));
      // Somewhere else, so that the next round finds it anew.
      const double aside = round % 2 == 0 ? 40.0 : -40.0;
      (void)link.Ask(MethodOfLens("Move"), {{"lens", lens}, {"axis", "focus"}, {"target", {{"relative", aside}}}});
    }
  }
  return points;
}

/// What was asked for that cannot be, or not together.
std::expected<void, Failure> CheckWays(const CalibrateText& text) {
  const int ways = !text.file.empty() + !text.targets.empty() + !text.points.empty() + text.show + text.remove;
  if (ways != 1) {
    return Refuse(Exit::Usage,
                  "say one of --at DEPTH (guided), --point STEPS=DEPTH, --from-file FILE, --show and --remove");
  }
  if (text.all && !text.remove) return Refuse(Exit::Usage, "--all belongs to --remove: write --remove --all");
  if (text.remove && text.plot.wanted()) {
    return Refuse(Exit::Usage,
                  "--remove leaves no curve to draw; draw it before: lensctl calibrate --show --plot curve.svg");
  }
  return CheckPlot(text.plot);
}

Outcome Calibrate(Session& session, const CalibrateText& text) {
  if (auto good = CheckWays(text); !good) return PassOn(good);
  const Json lens = LensOf(text.name);
  Json parameters{{"lens", lens}};
  if (const auto& from = session.globals().from) {
    parameters["distanceFrom"] = kFromNames.at(static_cast<std::size_t>(*from));
  }
  if (!text.error.empty()) {
    auto error = ParseLength(text.error, "--error");
    if (!error) return PassOn(error);
    parameters["errorUm"] = error->value * 1e6;
  }
  if (!text.file.empty()) {
    std::ifstream in(text.file, std::ios::binary);
    std::ostringstream whole;
    if (!in || !(whole << in.rdbuf())) return Refuse(Exit::NoInput, text.file + ": cannot be read");
    parameters = {{"lens", lens}, {"toml", whole.str()}};
  }
  Json points = Json::array();
  for (const std::string& one : text.points) {
    auto point = PointOf(one);
    if (!point) return PassOn(point);
    points.push_back(*std::move(point));
  }
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  if (text.show) {
    auto reply = link->Ask(MethodOfLens("GetCalibration"), {{"lens", lens}});
    if (!reply) return PassOn(reply);
    return Show(session, *reply, text.plot, Shows::WholeFile);
  }
  if (!text.targets.empty()) {
    auto found = Guided(session, *link, text, lens);
    if (!found) return PassOn(found);
    points = *std::move(found);
    parameters["made"] = "by autofocus on " + std::to_string(text.targets.size()) + " targets";
  }
  if (!points.empty()) {
    parameters["points"] = points;
    parameters["approximate"] = text.data_sheet;
    if (!parameters.contains("made")) parameters["made"] = text.data_sheet ? "from a data sheet" : "by hand";
  }
  if (text.remove) parameters = {{"lens", lens}, {"remove", true}, {"keepMeasured", !text.all}};
  auto reply = link->Ask(MethodOfLens("Calibrate"), parameters);
  if (!reply) {
    // A file that makes no sense is no mistake of the command line.
    Failure failure = reply.error();
    if (!text.file.empty() && failure.status == Exit::Usage) failure.status = Exit::BadData;
    if (failure.status == Exit::BadData) failure.message = text.file + ": " + failure.message;
    return std::unexpected(std::move(failure));
  }
  return Show(session, *reply, text.plot, Shows::OneLine);
}

struct BacklashText {
  std::vector<std::string> words;
  std::string steps;
  int pairs = 0;
  PlotText plot;
};

Outcome Backlash(Session& session, const BacklashText& text) {
  Json parameters = Json::object();
  for (const std::string& word : text.words) {
    const char* const what = IsAxis(word) ? "axis" : "lens";
    if (parameters.contains(what)) return Refuse(Exit::Usage, UnknownAxis(text.words.back()));
    parameters[what] = word;
  }
  if (!text.steps.empty()) {
    auto steps = ParseNumber(text.steps, "--steps");
    if (!steps) return PassOn(steps);
    if (*steps->Nearest() < 0.0) {
      return Refuse(Exit::Usage,
                    "--steps '" + text.steps + "': backlash is not negative; write its native steps, such as 12");
    }
    parameters["size"] = *steps->Nearest();
  }
  if (text.pairs > 0) parameters["pairs"] = text.pairs;
  if (auto good = CheckPlot(text.plot); !good) return PassOn(good);
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  const Json lens = parameters.contains("lens") ? parameters["lens"] : Json(nullptr);
  ProgressLine line(session);
  const auto show = [&](const Json& part) {
    if (!part.contains("progress")) return true;
    const Json& now = part["progress"];
    line.Show("sweep " + NumberText(now, "sweep", 4, " of ") + NumberText(now, "sweepsExpected", 4, ", ") +
              NumberText(now, "frames", 6, " frames"));
    return true;
  };
  auto reply = link->Follow(MethodOfLens("MeasureBacklash"), parameters, show, [&] {
    line.Clear();
    StopAndTell(session, lens, nullptr);
  });
  line.Clear();
  if (!reply) return PassOn(reply);
  const Json& result = (*reply)["backlash"];
  if (text.plot.wanted() && result.value("known", false)) {
    if (auto drawn = WritePlot(text.plot, io::ChartSvg(BacklashChart(result))); !drawn) return PassOn(drawn);
  }
  session.json() ? session.PrintJson(result) : session.PrintText(BacklashLine(result));
  return result.value("known", false) ? Exit::Done : Exit::No;
}

}  // namespace

void AddCalibrate(CLI::App& root, Run& run) {
  auto text = std::make_shared<CalibrateText>();
  auto* command = root.add_subcommand("calibrate", "measure or enter which distance each focus position focuses at")
                      ->group(kOnline);
  command->add_option("NAME", text->name, "lens");
  command
      ->add_option("--at", text->targets,
                   "guided: autofocus on a target at this distance or vergence; four or more also give the error")
      ->type_name("DEPTH");
  command->add_option("--repeat", text->repeat, "autofocus runs at each target")
      ->capture_default_str()
      ->check(CLI::Range(1, 20));
  command->add_option("--point", text->points, "a known position and its depth: 1200=0.8m 0=inf 3000=ext:0.8mm")
      ->type_name("STEPS=DEPTH");
  command->add_flag("--data-sheet", text->data_sheet,
                    "the points come from a data sheet, such as the two ends of focus; their grade is approximate, and "
                    "--error is needed");
  command->add_option("--error", text->error, "error of the curve in extension, such as 5um; estimated when left out")
      ->type_name("LENGTH");
  command->add_option("--from-file", text->file, "use this calibration file")->type_name("FILE");
  command->add_flag("--show", text->show, "print the calibration in use, as a file");
  command->add_flag("--remove", text->remove,
                    "back to the nominal figures; backlash, focus shifts and samples of focus-at stay");
  command->add_flag("--all", text->all, "with --remove: remove backlash, focus shifts and samples of focus-at too");
  AddPlotOptions(*command, text->plot, "the curve: extension or vergence over native positions");
  command->callback([&run, text] { run = [text](Session& session) { return Calibrate(session, *text); }; });
}

void AddBacklash(CLI::App& root, Run& run) {
  auto text = std::make_shared<BacklashText>();
  auto* command = root.add_subcommand("backlash", "measure the backlash of focus, or enter it")->group(kOnline);
  command->add_option("words", text->words, "[NAME] [AXIS]")->expected(0, 2)->type_name("");
  command->add_option("--steps", text->steps, "set the backlash to this many native steps, without measuring")
      ->type_name("N");
  command->add_option("--pairs", text->pairs, "pairs of sweeps (default 5); more pairs narrow the interval")
      ->check(CLI::Range(3, 100));
  AddPlotOptions(*command, text->plot, "the steps that a reversal loses, with their interval");
  command->callback([&run, text] { run = [text](Session& session) { return Backlash(session, *text); }; });
}

}  // namespace lensd::cli
