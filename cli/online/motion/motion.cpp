// focus, aperture, home, here, stop.
#include <CLI/CLI.hpp>
#include <memory>

#include "base/missing_optics.h"
#include "cli/link/arguments.h"
#include "cli/link/daemon_client.h"
#include "cli/link/drive.h"
#include "cli/link/lens_info.h"
#include "cli/link/target.h"
#include "cli/online/commands.h"
#include "cli/text/quantity.h"
#include "cli/text/text.h"
#include "cli/text/texts.h"
#include "optics/thin_lens.h"

namespace lensd::cli {
namespace {

using varlink::Json;

/// Where a distance was typed from elsewhere than the lens centre, the answer says that its own starts there.
void SayOrigin(DaemonClient& link, const Json& lens) {
  const auto info = FindInfo(link, lens.is_null() ? "" : lens.get<std::string>());
  if (!info || !info->value("optics", Json()).is_object()) return;
  if (TextOf((*info)["optics"], "distanceFrom") != "lens") SayWhereDistancesStart();
}

/// The end of a range of distances in the unit in which the person types, rounded to the inside of the range: whoever
/// types it again is not refused.
std::string ReachableText(double end_m, bool is_minimum) {
  constexpr double kStep = 2e-5;  // relative; DistanceText shows four digits or five
  constexpr int kSteps = 100;
  for (int i = 0; i < kSteps; ++i) {
    std::string text = DistanceText({end_m * (1.0 + (is_minimum ? i : -i) * kStep)});
    const auto read = ParseDepth(text, "");
    if (read && read->IsDistance() && (is_minimum ? read->value >= end_m : read->value <= end_m)) return text;
  }
  return DistanceText({end_m});
}

/// A distance that is out of reach, and what is in reach, in the unit in which the person types; lensd says metres.
void SayInTypedUnit(double wish_m, Failure& failure) {
  const DistanceUnit unit = ShownDistanceUnit();
  if (failure.status != Exit::OutOfRange || !failure.details || failure.details->value("unit", Json()) != "m") return;
  if (unit == DistanceUnit::Metres || unit == DistanceUnit::Dioptres) return;
  if (failure.message.find(" is outside what focus may reach: ") == std::string::npos) return;
  const auto end = [&](const char* key) {
    const Json number = failure.details->value(key, Json());
    return number.is_number() ? ReachableText(number.get<double>(), key == std::string_view("minimum")) : "infinity";
  };
  failure.message =
      DistanceText({wish_m}) + " is outside what focus may reach: " + end("minimum") + " to " + end("maximum");
}

/// Moves one axis and prints the result. Control-C stops the axis.
Outcome Move(Session& session, Json lens, const char* axis, Json target, const Json& extra = Json::object()) {
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  Json parameters{{"lens", lens}, {"axis", axis}, {"target", std::move(target)}};
  if (const auto& from = session.globals().from) {
    parameters["distanceFrom"] = kFromNames.at(static_cast<std::size_t>(*from));
  }
  parameters.update(extra);
  if (parameters["target"].contains("distanceM") && !parameters.contains("distanceFrom") && !session.json()) {
    SayOrigin(*link, lens);
  }
  const Json wish = parameters["target"].value("distanceM", Json());
  auto reply = Drive(session, *link, MethodOfLens("Move"), std::move(parameters), axis);
  if (!reply && wish.is_number()) {
    Failure failure = reply.error();
    SayInTypedUnit(wish.get<double>(), failure);
    return std::unexpected(std::move(failure));
  }
  if (!reply) return PassOn(reply);
  const Json& move = (*reply)["move"];
  session.json() ? session.PrintJson(move) : session.PrintText(MoveText(move));
  return move.value("reached", false) ? Exit::Done : Exit::No;
}

struct FocusText {
  std::vector<std::string> words;
  std::string blur_limit;
};

/// H = f + f²/(N C) at today's focal length and f-number, C in pixels of the lens' own camera where it is said so.
std::expected<Json, Failure> HyperfocalTarget(Session& session, const Json& lens, const std::string& blur_limit) {
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  const auto info = FindInfoOnceOpened(*link, lens.is_null() ? "" : lens.get<std::string>());
  if (!info) return PassOn(info);
  const auto status = link->Ask(MethodOfLens("Status"), {{"lens", (*info)["name"]}});
  if (!status) return PassOn(status);
  const Json& now = (*status)["lenses"][0];
  if (!now.value("connected", false)) return Refuse(Exit::Unavailable, TextOf(now, "error"));
  if (!now["focalLengthMm"].is_number() || !now["fNumber"].is_number()) {
    if (auto lost = WhereUnknown(*info, now, "there is no hyperfocal distance"))
      return std::unexpected(*std::move(lost));
    return Refuse(Exit::Unsupported,
                  OpticsMissing("there is no hyperfocal distance: the focal length or f-number of this lens is"));
  }
  const Json camera = info->value("camera", Json());
  std::optional<Decimal> pixel;
  if (camera.is_object() && camera["pixelUm"].is_number()) {
    pixel = Decimal::Shortest(camera["pixelUm"].get<double>() * 1e-6);
  }
  const auto limit = ParseBlurLimit(blur_limit.empty() ? "1px" : blur_limit, pixel, "--blur-limit");
  if (!limit) return PassOn(limit);
  const double f = now["focalLengthMm"].get<double>() * 1e-3;
  return Json{{"distanceM", optics::thin_lens::Hyperfocal(f, now["fNumber"].get<double>(), *limit->Nearest())}};
}

/// A distance as lensctl prints it, "1.2 m from the sensor": the distance, and the parameter that says where it starts.
std::pair<std::string, Json> WithoutOrigin(const std::string& text) {
  constexpr std::pair<std::string_view, const char*> kEnds[] = {{" from the lens centre", "lens"},
                                                                {" from the sensor", "sensor"}};
  for (const auto& [end, origin] : kEnds) {
    if (text.ends_with(end)) return {text.substr(0, text.size() - end.size()), {{"distanceFrom", origin}}};
  }
  return {text, Json::object()};
}

Outcome Focus(Session& session, const FocusText& text) {
  const NameAndValue given = SplitNameAndValue(text.words);
  if (given.value == "hyperfocal") {
    auto target = HyperfocalTarget(session, given.lens, text.blur_limit);
    if (!target) return PassOn(target);
    return Move(session, given.lens, "focus", *std::move(target), {{"distanceFrom", "lens"}});
  }
  if (!text.blur_limit.empty()) return Refuse(Exit::Usage, "--blur-limit belongs to the target hyperfocal only");
  const auto [place, origin] = WithoutOrigin(given.value);
  auto target = ParseFocusTarget(place);
  const auto reads = [](std::string_view word) { return word == "hyperfocal" || ParseFocusTarget(word).has_value(); };
  const auto meant = MeantByTwoWords(text.words, "focus", reads);
  if (!target && meant) return Refuse(Exit::Usage, *meant);
  if (!target && text.words.size() == 1 && IsLens(session, given.value)) {
    return Refuse(Exit::Usage, "'" + given.value +
                                   "' is a lens, and the TARGET is missing: say where to, as in focus " + given.value +
                                   " 1.2m");
  }
  if (!target) return PassOn(target);
  return Move(session, given.lens, "focus", *std::move(target), origin);
}

Outcome Aperture(Session& session, const std::vector<std::string>& words, bool keep_brightness) {
  const NameAndValue given = SplitNameAndValue(words);
  Json extra = Json::object();
  if (keep_brightness) extra["keepBrightness"] = true;
  auto steps = ParseStepTarget(given.value, "N");
  if (!steps) return PassOn(steps);
  if (*steps) return Move(session, given.lens, "iris", **std::move(steps), extra);
  auto f_number = ParseFNumber(given.value, "N");
  const auto reads = [](std::string_view word) { return ParseFNumber(word, "N").has_value(); };
  const auto meant = MeantByTwoWords(words, "aperture", reads);
  if (!f_number && meant) return Refuse(Exit::Usage, *meant);
  if (!f_number) return PassOn(f_number);
  return Move(session, given.lens, "iris", {{"fNumber", *f_number->Nearest()}}, extra);
}

struct ZoomText {
  std::vector<std::string> words;
  std::string tolerance;
  bool free = false;
};

Outcome Zoom(Session& session, const ZoomText& text) {
  const NameAndValue given = SplitNameAndValue(text.words);
  auto steps = ParseStepTarget(given.value, "F");
  if (!steps) return PassOn(steps);
  if (*steps) return Move(session, given.lens, "zoom", **std::move(steps));  // the motor alone: optics may be unknown
  auto focal_length = ParsePositiveLength(given.value, "F");
  const auto reads = [](std::string_view word) { return ParsePositiveLength(word, "F").has_value(); };
  const auto meant = MeantByTwoWords(text.words, "zoom", reads);
  if (!focal_length && meant) return Refuse(Exit::Usage, *meant);
  if (!focal_length) return PassOn(focal_length);
  if (given.value.starts_with('+')) {
    return Refuse(Exit::Usage, "F '" + given.value + "': a focal length has no sign; +N and -N are counts of steps");
  }
  if (text.free && !text.tolerance.empty()) {
    return Refuse(Exit::Usage,
                  "--tolerance is for a focus that follows, and with --free it does not follow: give only one of them");
  }
  Json extra{{"keepFocus", !text.free}};
  if (!text.tolerance.empty()) {
    auto tolerance = ParsePositiveLength(text.tolerance, "--tolerance");
    if (!tolerance) return PassOn(tolerance);
    extra["trackingToleranceUm"] = *tolerance->Nearest() * 1e6;
  }
  return Move(session, given.lens, "zoom", {{"focalLengthMm", *focal_length->Nearest() * 1e3}}, extra);
}

Outcome Filter(Session& session, const std::vector<std::string>& words) {
  const NameAndValue given = SplitNameAndValue(words);
  auto place = ParseNumber(given.value, "K");
  if (!place) return PassOn(place);
  return Move(session, given.lens, "filter", {{"position", *place->Nearest()}});
}

Outcome Home(Session& session, const std::vector<std::string>& words) {
  // One word alone is an axis or a lens: a lens is never named like an axis.
  const bool only_lens = words.size() == 1 && !IsAxis(words[0]);
  const NameAndValue given = only_lens ? NameAndValue{words[0], ""} : SplitNameAndValue(words);
  if (!given.value.empty() && !IsAxis(given.value)) {
    return Refuse(Exit::Usage, UnknownAxis(given.value));
  }
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  const Json axis = LensOf(given.value);
  auto reply = Drive(session, *link, MethodOfLens("Home"), {{"lens", given.lens}, {"axis", axis}}, axis);
  if (!reply) return PassOn(reply);
  const Json& moves = (*reply)["moves"];
  if (session.json()) session.PrintJson(axis.is_null() ? moves : moves[0]);
  bool all_reached = true;
  for (const Json& move : moves) {
    if (!session.json()) session.PrintText(MoveText(move));
    all_reached &= move.value("reached", false);
  }
  return all_reached ? Exit::Done : Exit::No;
}

/// `[NAME] [AXIS] @N` as it was written.
struct PlaceSaid {
  Json lens;
  std::string axis = "focus";
  Json position;
};

std::expected<PlaceSaid, Failure> ParsePlaceSaid(std::vector<std::string> words) {
  auto place = ParseStepTarget(words.back(), "@N");
  if (!place) return PassOn(place);
  if (!*place || !(*place)->contains("position")) {
    return Refuse(Exit::Usage, "'" + words.back() + "': say at which position it stands, as in @1200");
  }
  PlaceSaid said{.lens = nullptr, .position = (**place)["position"]};
  words.pop_back();
  if (!words.empty() && IsAxis(words.back())) {
    said.axis = words.back();
    words.pop_back();
  }
  if (words.size() == 2) return Refuse(Exit::Usage, UnknownAxis(words.back()));
  if (!words.empty()) said.lens = words.front();
  return said;
}

Outcome Here(Session& session, const std::vector<std::string>& words) {
  const auto said = ParsePlaceSaid(words);
  if (!said) return PassOn(said);
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  auto reply = link->Ask(MethodOfLens("SetPosition"),
                         {{"lens", said->lens}, {"axis", said->axis}, {"position", said->position}});
  if (!reply) return PassOn(reply);
  session.json() ? session.PrintJson({{"axis", said->axis}, {"position", said->position}})
                 : session.PrintText(said->axis + " stands at " + Short(said->position.get<double>(), 8) +
                                     ", and counts from there; nothing has moved");
  return Exit::Done;
}

Outcome Stop(Session& session, const std::string& name) {
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  auto reply = link->Ask(MethodOfLens("Stop"), {{"lens", LensOf(name)}});
  if (!reply) return PassOn(reply);
  session.json() ? session.PrintJson({{"stopped", true}}) : session.PrintText("stopped");
  return Exit::Done;
}

/// A command whose words are `[NAME] VALUE`.
void AddWords(CLI::App& root, Run& run, const char* name, const char* about, const char* words_about, int least,
              Outcome (*act)(Session&, const std::vector<std::string>&), int most = 2) {
  auto words = std::make_shared<std::vector<std::string>>();
  auto* command = root.add_subcommand(name, about)->group(kOnline);
  command->add_option("words", *words, words_about)->expected(least, most)->required(least > 0)->type_name("");
  command->callback([&run, words, act] { run = [words, act](Session& session) { return act(session, *words); }; });
}

}  // namespace

void AddFocus(CLI::App& root, Run& run) {
  auto text = std::make_shared<FocusText>();
  auto* command = root.add_subcommand("focus", "move focus and report where it stands")->group(kOnline);
  command
      ->add_option(
          "words", text->words,
          "[NAME] TARGET: a distance or vergence (0.8m, 1.2D, inf), hyperfocal, +N or -N steps, near:N or far:N "
          "steps, @N a position, ext:2.6mm an extension")
      ->expected(1, 2)
      ->required()
      ->type_name("");
  command
      ->add_option("--blur-limit", text->blur_limit,
                   "with hyperfocal: blur that still counts as sharp, such as 2px or 8um; 1px when left out")
      ->type_name("C");
  command->callback([&run, text] { run = [text](Session& session) { return Focus(session, *text); }; });
}

void AddAperture(CLI::App& root, Run& run) {
  struct Options {
    std::vector<std::string> words;
    bool keep_brightness = false;
  };
  auto options = std::make_shared<Options>();
  auto* command = root.add_subcommand("aperture", "move the iris and report where it stands")->group(kOnline);
  command->add_option("words", options->words, "[NAME] N: an f-number (2.8 or f/2.8), +N or -N steps, @N a position")
      ->expected(1, 2)
      ->required()
      ->type_name("");
  command->add_flag("--keep-brightness", options->keep_brightness,
                    "change the camera's exposure so that the picture keeps its brightness, as far as possible");
  command->callback([&run, options] {
    run = [options](Session& session) { return Aperture(session, options->words, options->keep_brightness); };
  });
}

void AddZoom(CLI::App& root, Run& run) {
  auto text = std::make_shared<ZoomText>();
  auto* command =
      root.add_subcommand("zoom", "change the focal length; focus follows, so that the plane in focus stays");
  command->group(kOnline);
  command
      ->add_option(
          "words", text->words,
          "[NAME] F: a focal length, such as 35mm; with +N or -N steps or @N (a position) focus does not follow")
      ->expected(1, 2)
      ->required()
      ->type_name("");
  command->add_flag("--free", text->free, "focus does not follow");
  command->add_option("--tolerance", text->tolerance, "how far focus may be off during the move, as extension")
      ->type_name("LENGTH");
  command->callback([&run, text] { run = [text](Session& session) { return Zoom(session, *text); }; });
}

void AddFilter(CLI::App& root, Run& run) {
  AddWords(root, run, "filter", "turn the filter wheel", "[NAME] K: a filter wheel position", 1, Filter);
}

void AddHome(CLI::App& root, Run& run) {
  AddWords(root, run, "home", "search for the reference of an axis, or of all that have one", "[NAME] [AXIS]", 0, Home);
}

void AddHere(CLI::App& root, Run& run) {
  AddWords(root, run, "here",
           "enter the position of an axis that counts its steps and has no reference, for example after a loss of "
           "power; nothing moves",
           "[NAME] [AXIS] @N: its native position (focus when no AXIS is named)", 1, Here, 3);
}

void AddStop(CLI::App& root, Run& run) {
  auto name = std::make_shared<std::string>();
  auto* command =
      root.add_subcommand("stop", "stop everything a lens does, whichever client started it")->group(kOnline);
  command->add_option("NAME", *name, "lens");
  command->callback([&run, name] { run = [name](Session& session) { return Stop(session, *name); }; });
}

}  // namespace lensd::cli
