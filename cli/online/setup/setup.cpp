// setup: the first hour with an unknown lens, in a few minutes: how its axes move, where focus is, what a reversal
// loses, how much blur a step makes, whether focus turns the way that is configured. It writes nothing: it prints the
// lines to put into the configuration. Backlash and direction alone are kept, by lensd.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "cli/link/arguments.h"
#include "cli/link/drive.h"
#include "cli/link/lens_info.h"
#include "cli/link/progress.h"
#include "cli/online/commands.h"
#include "cli/online/setup/setup_direction.h"
#include "cli/online/setup/setup_save.h"
#include "cli/online/setup/setup_text.h"
#include "cli/text/quantity.h"
#include "cli/text/text.h"
#include "cli/text/texts.h"

namespace lensd::cli {
namespace {

using varlink::Json;

constexpr Duration kFocusBudget = std::chrono::seconds(25), kOtherBudget = std::chrono::seconds(10);
constexpr int kPairs = 3;             ///< of sweeps: enough for an interval
constexpr double kOpticsApart = 0.1;  ///< beyond the interval of the blur: optics are told in round numbers

struct SetupOptions {
  std::string name;
  std::string region;
  std::string at;
  bool home = false;
  bool save = false;
};

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
std::expected<Json, Failure> SetUpAxis(DaemonClient& link, const std::string& lens, const Json& info,
                                       const Json& status) {
  Json found{{"axis", info["axis"]},
             {"unit", info["unit"]},
             {"minimum", info["minimum"]},
             {"maximum", info["maximum"]},
             {"feedback", info["feedback"]}};
  const bool focus = info["axis"] == "focus";
  if (info["unit"] == "position") return found;  // places of a wheel: nothing lies between them
  auto motion = MeasureMotion(link, lens, info, status["position"].get<double>(), focus ? kFocusBudget : kOtherBudget);
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

/// A slow lens has its patience asked for, as soon as its speed is known.
void SayHowLong(Session& session, const Json& axis) {
  constexpr double kOthersS = 35.0, kTravels = 15.0, kMoves = 150.0;  // by the run times of simulated lenses
  constexpr double kWorthSayingS = 100.0;
  if (axis["axis"] != "focus" || !axis.contains("speed") || !axis["speed"].is_object()) return;
  const double range = axis["maximum"].get<double>() - axis["minimum"].get<double>();
  const double travel_s = range / axis["speed"]["value"].get<double>();
  const double overhead_s = 1e-3 * axis["overheadMs"]["value"].get<double>();
  const double whole_s = kOthersS + kTravels * travel_s + kMoves * overhead_s;
  if (whole_s < kWorthSayingS) return;
  session.Remark("focus takes " + Short(travel_s, 2) + " s for its whole travel: setup takes about " +
                 Short(std::ceil(whole_s / 60.0), 2) + " minutes in all");
}

const Json* FocusOf(const Json& info) {
  const auto axis = std::ranges::find_if(info["axes"], [](const Json& a) { return a["axis"] == "focus"; });
  return axis == info["axes"].end() ? nullptr : &*axis;
}

/// A lens whose direction is not known does not say how far its sensor is: the middle of what there is will do.
double ExtensionNear(const Json& status, const Json& optics) {
  if (status["extensionMm"].is_number()) return status["extensionMm"].get<double>();
  return 0.5 * (optics["extensionMinMm"].get<double>() + optics["extensionMaxMm"].get<double>());
}

/// Diameter of the blur that one step away from here makes, in pixels, by the configured optics.
double BlurPerStep(const Json& info, const Json& status) {
  const Json& optics = info["optics"];
  const Json& camera = info["camera"];
  const Json* const axis = FocusOf(info);
  if (!optics.is_object() || !camera.is_object() || !camera["pixelUm"].is_number() || !status["fNumber"].is_number() ||
      !status["focalLengthMm"].is_number() || axis == nullptr) {
    return 0.0;
  }
  const double travel = axis->at("maximum").get<double>() - axis->at("minimum").get<double>();
  const double step_mm =
      (optics["extensionMaxMm"].get<double>() - optics["extensionMinMm"].get<double>()) / std::max(travel, 1.0);
  const double f = status["focalLengthMm"].get<double>(), e = ExtensionNear(status, optics);
  return 1e3 * step_mm * f / (status["fNumber"].get<double>() * (f + e)) / camera["pixelUm"].get<double>();
}

/// As lensd takes it: "nearPositive", "nearNegative", or nothing where nobody says.
std::optional<std::string> DirectionIn(const Json& info) {
  const Json* const axis = FocusOf(info);
  if (axis == nullptr || !axis->contains("direction") || !axis->at("direction").is_string()) return std::nullopt;
  return axis->at("direction").get<std::string>();
}

/// What a blur of a pixel is in dioptres at this distance of the sensor, mm; a hundredth of all vergences where the
/// pixels are not known.
double VergenceOfBlur(const Json& info, const Json& status, double sensor_mm) {
  const Json& camera = info["camera"];
  if (!camera.is_object() || !camera["pixelUm"].is_number() || !status["fNumber"].is_number()) {
    return 1e-2 * 1e3 * info["optics"]["extensionMaxMm"].get<double>() / (sensor_mm * sensor_mm);
  }
  const double f = status["focalLengthMm"].get<double>();
  const double depth_mm = 1e-3 * camera["pixelUm"].get<double>() * status["fNumber"].get<double>() * sensor_mm / f;
  return 1e3 * depth_mm / (sensor_mm * sensor_mm);
}

/// The curve that slope and distance make, where the optics are known well enough for it.
void MakeCurve(const Json& status, std::optional<double> vergence, SetupFindings& found) {
  const Json &optics = found.info["optics"], &camera = found.info["camera"], &subject = found.autofocus["subject"];
  if (!found.slope.px_per_step || !vergence || !subject.is_object() || found.direction == "undecided") return;
  const auto direction = found.seen ? found.seen : DirectionIn(found.info);
  if (!optics.is_object() || !optics["focalLengthMaxMm"].is_null() || !direction) return;
  if (!camera["pixelUm"].is_number() || !status["fNumber"].is_number()) return;
  const Json* const axis = FocusOf(found.info);
  found.curve = CurveOf({.minimum = axis->at("minimum").get<double>(),
                         .maximum = axis->at("maximum").get<double>(),
                         .near_positive = *direction == "nearPositive",
                         .focus = subject["position"].get<double>(),
                         .vergence = *vergence,
                         .vergence_sigma = subject["sigmaD"].is_number() ? subject["sigmaD"].get<double>() : 0.0,
                         .focal_length_mm = optics["focalLengthMm"].get<double>(),
                         .f_number = status["fNumber"].get<double>(),
                         .pixel_um = camera["pixelUm"].get<double>()},
                        *found.slope.px_per_step);
}

/// Which way focus turns, where the optics and what autofocus found are told. Where no direction is known the place of
/// focus is read as that of a near-positive lens, even over its travel, as nominal figures have it.
void TellDirection(const Json& status, double vergence, SetupFindings& found) {
  const Json &optics = found.info["optics"], &subject = found.autofocus["subject"];
  const Json* const axis = FocusOf(found.info);
  if (axis == nullptr || !optics.is_object() || !status["focalLengthMm"].is_number() || !subject.is_object()) return;
  const double low = optics["extensionMinMm"].get<double>(), high = optics["extensionMaxMm"].get<double>();
  const double first = axis->at("minimum").get<double>(), steps = axis->at("maximum").get<double>() - first;
  const Json& lost = found.backlash;
  const double backlash = lost.is_object() && lost["sizeHigh"].is_number() ? lost["sizeHigh"].get<double>() : 0.0;
  DirectionFacts facts{.given = vergence,
                       .backlash_mm = backlash * (high - low) / std::max(steps, 1.0),
                       .focal_length = status["focalLengthMm"].get<double>(),
                       .extension_min = low,
                       .extension_max = high};
  const auto known = DirectionIn(found.info);
  if (!known) {
    const double f = facts.focal_length, along = (subject["position"].get<double>() - first) / std::max(steps, 1.0);
    const double extension = std::lerp(low, high, along);
    facts.found = 1e3 * extension / (f * (f + extension));
    facts.found_sigma = VergenceOfBlur(found.info, status, f + extension);
  } else if (subject["vergenceD"].is_number() && subject["sigmaD"].is_number()) {
    facts.found = subject["vergenceD"].get<double>();
    facts.found_sigma = subject["sigmaD"].get<double>();
  } else {
    return;
  }
  const std::string verdict = DirectionBy(facts);
  found.direction = known || verdict == "undecided" ? verdict : "found";
  if (verdict == "undecided") return;
  const bool near_positive = (!known || *known == "nearPositive") == (verdict == "right");
  found.seen = near_positive ? "nearPositive" : "nearNegative";
}

/// lensd remembers what was seen, and goes by it where neither the configuration nor a calibration says another.
void KeepSeen(DaemonClient& link, const std::string& lens, SetupFindings& found) {
  if (!found.seen) return;
  if (auto kept = link.Ask(MethodOfLens("KeepDirection"), {{"lens", lens}, {"direction", *found.seen}}); !kept) {
    found.remarks.push_back("the direction seen is not remembered: " + kept.error().message);
    return;
  }
  if (auto info = FindInfo(link, lens)) found.info = *std::move(info);
  found.goes_by_seen = DirectionIn(found.info) == found.seen;
}

std::expected<Json, Failure> StatusOf(DaemonClient& link, const std::string& lens) {
  auto reply = link.Ask(MethodOfLens("Status"), {{"lens", lens}});
  if (!reply) return PassOn(reply);
  return (*reply)["lenses"][0];
}

/// Finds the references. The iris goes back to its f-number: pictures that were well exposed stay so.
std::expected<void, Failure> GoHome(Session& session, DaemonClient& link, const std::string& lens,
                                    const Json& f_number) {
  if (auto homed = Drive(session, link, MethodOfLens("Home"), {{"lens", lens}}); !homed) return PassOn(homed);
  if (!f_number.is_number()) return {};
  auto back = Drive(session, link, MethodOfLens("Move"),
                    {{"lens", lens}, {"axis", "iris"}, {"target", {{"fNumber", f_number}}}});
  if (!back) return PassOn(back);
  return {};
}

/// What ends setup at once, and is no finding: Control-C, a stop, or a newer command for the lens.
bool EndsSetup(const Failure& failure) {
  return failure.status == Exit::Interrupted || failure.status == Exit::Stopped || failure.status == Exit::Superseded;
}

/// A long call of `parameters` and the region. Nothing: it was refused, and why is among the remarks.
std::expected<std::optional<Json>, Failure> Measure(DaemonClient& link, const char* what, std::string_view method,
                                                    Json parameters, const Json& region, SetupFindings& found) {
  if (!region.is_null()) parameters["region"] = region;
  auto reply = link.Follow(MethodOfLens(method), std::move(parameters), [](const Json&) { return true; });
  if (reply) return *std::move(reply);
  if (EndsSetup(reply.error())) return PassOn(reply);
  found.remarks.push_back(std::string(what) + ": " + reply.error().message);
  return std::nullopt;
}

/// Focus by the camera, what a reversal loses there, and which way it turns.
std::expected<void, Failure> SetUpFocus(DaemonClient& link, const std::string& lens, const Json& region,
                                        std::optional<double> vergence, SetupFindings& found) {
  auto focused = Measure(link, "autofocus", "Autofocus", {{"lens", lens}, {"deadlineMs", SearchAtMostMs(found.axes)}},
                         region, found);
  if (!focused) return PassOn(focused);
  if (!*focused) return {};
  found.autofocus = (**focused)["autofocus"];
  if (!found.autofocus.value("focused", false)) return {};
  auto status = StatusOf(link, lens);
  if (!status) return PassOn(status);
  found.blur_px_per_step = BlurPerStep(found.info, *status);
  auto backlash = Measure(link, "backlash", "MeasureBacklash", {{"lens", lens}, {"pairs", kPairs}}, region, found);
  if (!backlash) return PassOn(backlash);
  if (*backlash) found.backlash = (**backlash)["backlash"];
  if (vergence) TellDirection(*status, *vergence, found);
  KeepSeen(link, lens, found);
  return {};
}

/// How much blur a step is, and what follows from it; after the backlash, which is known to lensd from then on.
std::expected<void, Failure> SetUpBlur(DaemonClient& link, const std::string& lens, const Json& region,
                                       std::optional<double> vergence, SetupFindings& found) {
  if (!found.autofocus.is_object() || !found.autofocus.value("focused", false)) return {};
  const Json* const axis = FocusOf(found.info);
  if (axis == nullptr) return {};
  auto slope = MeasureBlurSlope(link, lens, *axis, region, found.autofocus["position"].get<double>());
  if (!slope && EndsSetup(slope.error())) return PassOn(slope);
  if (!slope) {
    found.slope.why_not = slope.error().message;
    return {};
  }
  found.slope = *std::move(slope);
  if (const auto& seen = found.slope.px_per_step; seen && found.blur_px_per_step > 0.0) {
    const double off = found.blur_px_per_step / seen->value;
    if (off < (1.0 - kOpticsApart) * seen->low / seen->value || off > (1.0 + kOpticsApart) * seen->high / seen->value) {
      found.remarks.push_back("the configured optics do not fit this lens: with them a step would be " + Short(off, 3) +
                              " times the blur that the pictures show");
    }
  }
  auto status = StatusOf(link, lens);
  if (!status) return PassOn(status);
  if ((*status)["fNumber"].is_number()) found.f_number = (*status)["fNumber"].get<double>();
  MakeCurve(*status, vergence, found);
  return {};
}

bool AllWell(const SetupFindings& found) {
  const auto well = [](const Json& axis) { return !axis.contains("trouble") || axis["trouble"].is_null(); };
  if (!std::ranges::all_of(found.axes, well) || (found.direction == "reversed" && !found.goes_by_seen)) return false;
  if (found.info["camera"].is_null()) return true;
  return found.autofocus.is_object() && found.autofocus.value("focused", false) && found.backlash.is_object() &&
         found.backlash.value("known", false);
}

/// Asks the daemon what the lens is, and finds its reference where that is wanted.
std::expected<Json, Failure> Begin(Session& session, DaemonClient& link, const SetupOptions& text,
                                   SetupFindings& found) {
  auto info = FindInfo(link, text.name);
  if (!info) return PassOn(info);
  found.info = *std::move(info);
  const std::string lens = TextOf(found.info, "name");
  link.WatchSignals([&session, lens] { StopAndTell(session, lens, nullptr); });
  auto status = StatusOnceOpened(link, lens, std::chrono::seconds(15));  // lensd may have just begun
  if (!status) return PassOn(status);
  if (auto opened = FindInfo(link, lens)) found.info = *std::move(opened);  // as its device says
  if (auto not_now = NotNow(*status, found.info, text.home)) return std::unexpected(*std::move(not_now));
  if (!text.home) return status;
  const bool has_iris = std::ranges::any_of(found.info["axes"], [](const Json& a) { return a["axis"] == "iris"; });
  const Json f_number = has_iris ? (*status)["fNumber"] : Json();
  if (auto homed = GoHome(session, link, lens, f_number); !homed) return PassOn(homed);
  if (has_iris && f_number.is_null()) {
    found.remarks.emplace_back("the position of the iris was not known: it stays where homing left it");
  }
  return StatusOf(link, lens);
}

/// Every axis in turn, then what the camera shows of focus.
std::expected<void, Failure> MeasureAll(Session& session, DaemonClient& link, const Json& status, const Json& region,
                                        std::optional<double> vergence, SetupFindings& found) {
  const std::string lens = TextOf(found.info, "name");
  const ActivityLine line(session, lens);
  for (std::size_t i = 0; i < found.info["axes"].size(); ++i) {
    auto axis = SetUpAxis(link, lens, found.info["axes"][i], status["axes"][i]);
    if (!axis) return PassOn(axis);
    found.axes.push_back(*std::move(axis));
    SayHowLong(session, found.axes.back());
  }
  if (found.info["camera"].is_null()) return {};
  if (auto done = SetUpFocus(link, lens, region, vergence, found); !done) return done;
  return SetUpBlur(link, lens, region, vergence, found);
}

/// Of what ended setup: that it has ended, and that nothing is saved.
Failure Ended(Failure failure, const std::string& lens, bool save) {
  if (failure.status != Exit::Superseded && failure.status != Exit::Stopped) return failure;
  const std::string why = failure.status == Exit::Stopped ? lens + " was stopped" : "another command moved " + lens;
  failure.message = "setup ended, since " + why + " (" + failure.message + ")" + (save ? "; nothing was saved" : "");
  return failure;
}

Outcome Setup(Session& session, const SetupOptions& text) {
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
  SetupFindings found;
  found.asked = !text.at.empty();
  auto status = Begin(session, *link, text, found);
  if (!status) return PassOn(status);
  const std::string lens = TextOf(found.info, "name");
  std::string file;
  if (text.save) {  // before anything moves
    auto own = OwnFileOf(*link, lens);
    if (!own) return PassOn(own);
    file = *std::move(own);
  }
  if (auto done = MeasureAll(session, *link, *status, region, vergence, found); !done) {
    return std::unexpected(Ended(std::move(done).error(), lens, text.save));
  }
  const double elapsed_ms = std::chrono::duration<double, std::milli>(MonotonicClock().Now() - began).count();
  session.json() ? session.PrintJson(SetupJson(found, elapsed_ms)) : session.PrintText(SetupText(found));
  if (text.save) {
    auto saved = SaveSetup(*link, file, found);
    if (!saved) return PassOn(saved);
    session.Remark(*saved);
  }
  return AllWell(found) ? Exit::Done : Exit::No;
}

}  // namespace

void AddSetup(CLI::App& root, Run& run) {
  auto text = std::make_shared<SetupOptions>();
  auto* command = root.add_subcommand("setup",
                                      "measure an unknown lens by moving it: speed, latency, backlash, blur of a step, "
                                      "direction, nominal curve; exit status 1 if focus or backlash was not found, a "
                                      "move failed or the direction is reversed, else 0")
                      ->group(kOnline);
  command->add_option("NAME", text->name, "lens");
  command->add_option("--roi", text->region, "the region of the picture to focus on; the camera's own when left out")
      ->type_name("X,Y,W,H");
  command
      ->add_option("--at", text->at,
                   "the distance of the subject, known to 2 %; gives the direction of focus and a nominal curve")
      ->type_name("DEPTH");
  command->add_flag("--save", text->save, "write speed and backlash into the file of lensctl add, and reload it");
  command->add_flag("--home", text->home, "search the references first, which may move to an end of the travel");
  command->callback([&run, text] { run = [text](Session& session) { return Setup(session, *text); }; });
}

}  // namespace lensd::cli
