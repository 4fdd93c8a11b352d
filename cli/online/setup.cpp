// setup: the first hour with an unknown lens, in under two minutes: how its axes move, where focus is, what a reversal
// loses, whether focus turns the way that is configured. It writes nothing: it prints the lines to put into the
// configuration. The backlash alone is kept, as `lensctl backlash` does it.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "cli/online/arguments.h"
#include "cli/online/commands.h"
#include "cli/online/drive.h"
#include "cli/online/lens_info.h"
#include "cli/online/progress.h"
#include "cli/online/setup_motion.h"
#include "cli/online/texts.h"
#include "cli/quantity.h"
#include "cli/text.h"

namespace lensd::cli {
namespace {

using varlink::Json;

constexpr Duration kFocusBudget = std::chrono::seconds(25), kOtherBudget = std::chrono::seconds(10);
constexpr double kSearchAtMostMs = 30e3;
constexpr int kPairs = 3;             ///< of sweeps: enough for an interval
constexpr double kClearlyNearer = 3;  ///< times: which of two explanations of a distance is the better one

struct SetupText {
  std::string name;
  std::string region;
  std::string at;
  bool home = false;
};

/// What one run found, as --json prints it.
struct Found {
  Json info;                          ///< LensInfo
  Json axes = Json::array();          ///< one an axis
  Json autofocus, backlash;           ///< results of the interface, or null
  std::string direction = "untried";  ///< right, reversed, undecided
  double blur_px_per_step = 0.0;      ///< by the nominal optics; 0: not known
  std::vector<std::string> remarks;
};

std::string IntervalText(const Json& measured, int digits, const char* unit) {
  if (!measured.is_object()) return "not known";
  return NumberText(measured, "value", digits, unit) + " (" + NumberText(measured, "low", digits, "") + " to " +
         NumberText(measured, "high", digits, ")");
}

/// Why there is nothing to set up now.
std::optional<Failure> NotNow(const Json& status, const Json& info, bool home) {
  const std::string name = status.value("name", "");
  if (!status.value("connected", false)) {
    return Failure(Exit::Unavailable, name + " is not there: " + TextOf(status, "error"));
  }
  if (status.value("latched", false)) {
    return Failure(Exit::Busy, name + " was stopped for good; `lensctl reset " + name + "` lets it move again");
  }
  for (std::size_t i = 0; i < info["axes"].size() && i < status["axes"].size(); ++i) {
    const Json& axis = info["axes"][i];
    if (home || !axis.value("needsHome", false) || status["axes"][i].value("homed", false)) continue;
    return Failure(Exit::NotHomed, TextOf(axis, "axis") + " does not know where it stands; `lensctl setup " + name +
                                       " --home` searches its reference first, which may go to an end of its travel");
  }
  return std::nullopt;
}

/// One axis, and what is to be told of it.
std::expected<Json, Failure> SetUpAxis(Session& session, DaemonClient& link, const std::string& lens, const Json& info,
                                       const Json& status) {
  Json found{{"axis", info["axis"]},
             {"unit", info["unit"]},
             {"minimum", info["minimum"]},
             {"maximum", info["maximum"]},
             {"feedback", info["feedback"]}};
  const bool focus = info["axis"] == "focus";
  if (info["unit"] == "position") return found;  // places of a wheel: nothing lies between them
  auto motion =
      MeasureMotion(session, link, lens, info, status["position"].get<double>(), focus ? kFocusBudget : kOtherBudget);
  if (!motion) return PassOn(motion);
  found["moves"] = motion->moves.size();
  found["speed"] = JsonOf(motion->speed);
  found["overheadMs"] = JsonOf(motion->overhead_ms);
  found["latencyMs"] = JsonOf(motion->latency_ms);
  found["restMs"] = JsonOf(motion->rest_ms);
  found["seenOnTheWay"] = std::ranges::any_of(motion->moves, &TimedMove::SeenOnTheWay);
  found["trouble"] = motion->trouble.empty() ? Json(nullptr) : Json(motion->trouble);
  return found;
}

/// Diameter of the blur that one step away from here makes, in pixels, by the configured optics.
double BlurPerStep(const Json& info, const Json& status) {
  const Json& optics = info["optics"];
  const Json& camera = info["camera"];
  if (!optics.is_object() || !camera.is_object() || !camera["pixelUm"].is_number() || !status["fNumber"].is_number() ||
      !status["extensionMm"].is_number()) {
    return 0.0;
  }
  const auto axis = std::ranges::find_if(info["axes"], [](const Json& a) { return a["axis"] == "focus"; });
  if (axis == info["axes"].end()) return 0.0;
  const double travel = axis->at("maximum").get<double>() - axis->at("minimum").get<double>();
  const double step_mm =
      (optics["extensionMaxMm"].get<double>() - optics["extensionMinMm"].get<double>()) / std::max(travel, 1.0);
  const double f = status["focalLengthMm"].get<double>(), e = status["extensionMm"].get<double>();
  return 1e3 * step_mm * f / (status["fNumber"].get<double>() * (f + e)) / camera["pixelUm"].get<double>();
}

/// A lens whose focus turns the other way stands where the mirrored extension says.
std::string DirectionBy(const Json& optics, const Json& status, double vergence) {
  if (!status["extensionMm"].is_number() || !status["focalLengthMm"].is_number()) return "untried";
  const double f = status["focalLengthMm"].get<double>(), e = status["extensionMm"].get<double>();
  const double mirrored = optics["extensionMinMm"].get<double>() + optics["extensionMaxMm"].get<double>() - e;
  const auto off = [&](double extension) { return std::abs(1e3 * extension / (f * (f + extension)) - vergence); };
  if (off(mirrored) > kClearlyNearer * off(e)) return "right";
  return off(e) > kClearlyNearer * off(mirrored) ? "reversed" : "undecided";
}

std::expected<Json, Failure> StatusOf(DaemonClient& link, const std::string& lens) {
  auto reply = link.Ask(MethodOfLens("Status"), {{"lens", lens}});
  if (!reply) return PassOn(reply);
  return (*reply)["lenses"][0];
}

/// Focus by the camera, and what a reversal loses there.
std::expected<void, Failure> SetUpFocus(Session& session, DaemonClient& link, const std::string& lens,
                                        const Json& region, std::optional<double> vergence, Found& found) {
  const auto stop = [&] { StopAndTell(session, lens, nullptr); };
  const auto with_region = [&](Json parameters) {
    if (!region.is_null()) parameters["region"] = region;
    return parameters;
  };
  auto focused = link.Follow(MethodOfLens("Autofocus"), with_region({{"lens", lens}, {"deadlineMs", kSearchAtMostMs}}),
                             nullptr, stop);
  if (!focused) {
    if (focused.error().status == Exit::Interrupted) return PassOn(focused);
    found.remarks.push_back("autofocus: " + focused.error().message);
    return {};
  }
  found.autofocus = (*focused)["autofocus"];
  if (!found.autofocus.value("focused", false)) return {};
  auto status = StatusOf(link, lens);
  if (!status) return PassOn(status);
  found.blur_px_per_step = BlurPerStep(found.info, *status);
  if (vergence && found.info["optics"].is_object()) {
    found.direction = DirectionBy(found.info["optics"], *status, *vergence);
  }
  auto backlash = link.Follow(
      MethodOfLens("MeasureBacklash"), with_region({{"lens", lens}, {"pairs", kPairs}}),
      [](const Json&) { return true; }, stop);
  if (!backlash) {
    if (backlash.error().status == Exit::Interrupted) return PassOn(backlash);
    found.remarks.push_back("backlash: " + backlash.error().message);
    return {};
  }
  found.backlash = (*backlash)["backlash"];
  return {};
}

std::string AxisText(const Json& axis) {
  const std::string unit = TextOf(axis, "unit") == "steps" ? " steps" : " " + TextOf(axis, "unit");
  std::string text = TextOf(axis, "axis") + ": " + NumberText(axis, "minimum", 6, " to ") +
                     NumberText(axis, "maximum", 6, unit.c_str()) + " as the device says, positions are " +
                     (axis["feedback"] == "none" ? "not told" : TextOf(axis, "feedback"));
  if (!axis.contains("speed")) return text + "\n";
  if (!axis["trouble"].is_null()) text += "\n  moves ended early: " + TextOf(axis, "trouble");
  text += "\n  speed      " + (axis["speed"].is_object() ? IntervalText(axis["speed"], 4, (unit + "/s").c_str())
                                                         : "not seen: its moves take as long whatever their length");
  text += "\n  each move  " + IntervalText(axis["overheadMs"], 3, " ms") + " beside its travel, of " +
          NumberText(axis, "moves", 3, " moves");
  if (axis.value("seenOnTheWay", false)) {
    text += "\n  latency    " + IntervalText(axis["latencyMs"], 3, " ms") + " until its position changes";
    text += "\n  at rest    " + IntervalText(axis["restMs"], 3, " ms") + " after its last position";
  } else {
    text += "\n  its position is never seen on its way";
  }
  return text + "\n";
}

std::string DirectionText(const std::string& direction) {
  if (direction == "right") return "direction: as configured\n";
  if (direction == "reversed") {
    return "direction: reversed; in [lens.focus] say the other one of near-positive and near-negative\n";
  }
  if (direction == "undecided") {
    return "direction: the subject fits both ways (it is in the middle of the travel, or the optics are not those "
           "configured); try another distance\n";
  }
  return "direction: not tried; --at DISTANCE tries it on a subject in the picture whose distance is known\n";
}

/// What goes into the configuration.
std::string ConfigurationText(const Found& found) {
  std::string text;
  for (const Json& axis : found.axes) {
    std::string lines;
    if (axis.contains("speed") && axis["speed"].is_object()) {
      lines += "speed = " + NumberText(axis["speed"], "value", 4, "\n");
    }
    if (axis["axis"] == "focus" && found.backlash.is_object() && found.backlash.value("known", false)) {
      lines += "backlash = " + std::to_string(std::lround(std::ceil(found.backlash["sizeHigh"].get<double>()))) + "\n";
    }
    if (!lines.empty()) text += "[lens." + TextOf(axis, "axis") + "]\n" + lines;
  }
  return text.empty() ? "" : "\nfor the configuration of " + TextOf(found.info, "name") + ":\n" + text;
}

std::string TextOfAll(const Found& found) {
  std::string text;
  for (const Json& axis : found.axes) text += AxisText(axis);
  if (found.info["camera"].is_null()) {
    text += "no camera: neither focus nor backlash can be measured\n";
  } else if (found.autofocus.is_object()) {
    text += AutofocusText(found.autofocus) + "\n";
    if (found.backlash.is_object()) text += BacklashLine(found.backlash) + "\n";
    if (found.blur_px_per_step > 0.0) {
      text +=
          "one step of focus is " + Short(found.blur_px_per_step, 3) + " px of blur here, by the optics configured\n";
    }
    text += DirectionText(found.direction);
  }
  for (const std::string& remark : found.remarks) text += remark + "\n";
  return text + ConfigurationText(found);
}

Json JsonOfAll(const Found& found, double elapsed_ms) {
  return {{"lens", found.info["name"]},
          {"axes", found.axes},
          {"autofocus", found.autofocus},
          {"backlash", found.backlash},
          {"direction", found.direction},
          {"blurPxPerStep", found.blur_px_per_step > 0.0 ? Json(found.blur_px_per_step) : Json(nullptr)},
          {"remarks", found.remarks},
          {"elapsedMs", elapsed_ms}};
}

bool AllWell(const Found& found) {
  const auto well = [](const Json& axis) { return !axis.contains("trouble") || axis["trouble"].is_null(); };
  if (!std::ranges::all_of(found.axes, well) || found.direction == "reversed") return false;
  if (found.info["camera"].is_null()) return true;
  return found.autofocus.is_object() && found.autofocus.value("focused", false) && found.backlash.is_object() &&
         found.backlash.value("known", false);
}

/// Asks the daemon what the lens is, and finds its reference where that is wanted.
std::expected<Json, Failure> Begin(Session& session, DaemonClient& link, const SetupText& text, Found& found) {
  auto info = FindInfo(link, text.name);
  if (!info) return PassOn(info);
  found.info = *std::move(info);
  const std::string lens = TextOf(found.info, "name");
  auto status = StatusOf(link, lens);
  if (!status) return PassOn(status);
  if (auto not_now = NotNow(*status, found.info, text.home)) return std::unexpected(*std::move(not_now));
  if (!text.home) return status;
  if (auto homed = Drive(session, link, MethodOfLens("Home"), {{"lens", lens}}); !homed) return PassOn(homed);
  return StatusOf(link, lens);
}

Outcome Setup(Session& session, const SetupText& text) {
  Json region;
  std::optional<double> vergence;
  if (!text.region.empty()) {
    auto parsed = ParseRegion(text.region, "--roi");
    if (!parsed) return PassOn(parsed);
    region = *std::move(parsed);
  }
  if (!text.at.empty()) {
    auto depth = ParseDepth(text.at, "--at");
    if (!depth) return PassOn(depth);
    vergence = depth->Vergence().value;
  }
  const Instant began = MonotonicClock().Now();
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  Found found;
  auto status = Begin(session, *link, text, found);
  if (!status) return PassOn(status);
  const std::string lens = TextOf(found.info, "name");
  {
    const ActivityLine line(session, lens);
    for (std::size_t i = 0; i < found.info["axes"].size(); ++i) {
      auto axis = SetUpAxis(session, *link, lens, found.info["axes"][i], (*status)["axes"][i]);
      if (!axis) return PassOn(axis);
      found.axes.push_back(*std::move(axis));
    }
    if (!found.info["camera"].is_null()) {
      if (auto done = SetUpFocus(session, *link, lens, region, vergence, found); !done) return PassOn(done);
    }
  }
  const double elapsed_ms = std::chrono::duration<double, std::milli>(MonotonicClock().Now() - began).count();
  session.json() ? session.PrintJson(JsonOfAll(found, elapsed_ms)) : session.PrintText(TextOfAll(found));
  return AllWell(found) ? Exit::Done : Exit::No;
}

}  // namespace

void AddSetup(CLI::App& root, Run& run) {
  auto text = std::make_shared<SetupText>();
  auto* command =
      root.add_subcommand("setup", "measure an unknown lens by moving it: speed, latency, backlash, direction")
          ->group(kOnline);
  command->add_option("NAME", text->name, "lens");
  command->add_option("--roi", text->region, "the part of the picture to focus on; the camera's own when left out")
      ->type_name("X,Y,W,H");
  command->add_option("--at", text->at, "how far away that is: then the direction of focus is tried")
      ->type_name("DEPTH");
  command->add_flag("--home", text->home, "search the references first, which may go to an end of the travel");
  command->callback([&run, text] { run = [text](Session& session) { return Setup(session, *text); }; });
}

}  // namespace lensd::cli
