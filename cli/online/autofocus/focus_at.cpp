// focus-at go, add, show, forget: focus by coordinates that are not the lens's own.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <charconv>
#include <memory>

#include "cli/link/arguments.h"
#include "cli/link/daemon_client.h"
#include "cli/link/drive.h"
#include "cli/online/commands.h"
#include "cli/text/quantity.h"
#include "cli/text/text.h"
#include "cli/text/texts.h"

namespace lensd::cli {
namespace {

using varlink::Json;

struct FocusAtOptions {
  std::vector<std::string> words;
  std::string position;
  std::string sigma;
  int sample = 0;
};

/// A lens and a place; either may be left out.
struct LensAndPlace {
  Json lens;
  Json at = Json::array();
};

/// Letters, with what units have between and after them: "mm", "um/s", "mm^2", "%", "°". Not 'e' and 'x', which are
/// what is left of a number that was cut or is not decimal.
bool IsUnit(const std::string& unit) {
  if (unit.empty()) return true;
  const auto letter = [](unsigned char c) { return std::isalpha(c) != 0 || c == '%' || c >= 0x80; };
  const auto part = [&](unsigned char c) {
    return letter(c) || c == '/' || c == '^' || c == '*' || std::isdigit(c) != 0;
  };
  const bool exponent = (unit[0] == 'e' || unit[0] == 'E' || unit[0] == 'x' || unit[0] == 'X') &&
                        (unit.size() == 1 || std::isdigit(static_cast<unsigned char>(unit[1])) != 0 || unit[0] == 'x');
  return letter(static_cast<unsigned char>(unit[0])) && !exponent && std::ranges::all_of(unit, part);
}

/// "x=12.5mm": a name, a number and a unit.
Result<Json> CoordinateOf(const std::string& word) {
  const std::size_t equals = word.find('=');
  const char* const end = word.data() + word.size();
  const char* begin = word.data() + equals + 1;
  // A sign before a number that starts with a digit or a point: from_chars knows no plus, and takes nan and inf.
  const bool plus = begin != end && *begin == '+';
  const char* const digits = begin + (begin != end && (plus || *begin == '-') ? 1 : 0);
  const bool number = digits != end && (*digits == '.' || (*digits >= '0' && *digits <= '9'));
  double value = 0.0;
  const auto read = std::from_chars(plus ? digits : begin, end, value);
  const std::string unit(read.ptr, end);
  if (equals == 0 || !number || read.ec != std::errc() || !IsUnit(unit)) {
    return Fail(Code::InvalidArgument,
                "'" + word + "': a coordinate is NAME=VALUE, a number and then its unit, such as x=12.5mm");
  }
  return Json{{"name", word.substr(0, equals)}, {"value", value}, {"unit", unit.empty() ? Json(nullptr) : Json(unit)}};
}

Result<LensAndPlace> PlaceIn(const std::vector<std::string>& words) {
  LensAndPlace place;
  for (const std::string& word : words) {
    if (word.contains('=')) {
      auto coordinate = CoordinateOf(word);
      if (!coordinate) return PassOn(coordinate);
      place.at.push_back(*std::move(coordinate));
    } else if (place.lens.is_null() && place.at.empty()) {
      place.lens = word;
    } else {
      return Fail(Code::InvalidArgument, "'" + word + "': after the lens come coordinates, such as x=12.5mm");
    }
  }
  return place;
}

Result<LensAndPlace> NeededPlaceIn(const std::vector<std::string>& words) {
  auto place = PlaceIn(words);
  if (place && place->at.empty()) {
    return Fail(Code::InvalidArgument, "say the place by one to three coordinates, such as x=12.5mm y=3mm");
  }
  return place;
}

/// "x=12.5mm y=3mm", as it is written.
std::string PlaceText(const Json& at) {
  std::string text;
  for (const Json& value : at) {
    text += (text.empty() ? "" : " ") + TextOf(value, "name") + "=" + NumberText(value, "value", 6, "") +
            TextOf(value, "unit");
  }
  return text;
}

std::string PredictionText(const Json& place) {
  std::string text = PlaceText(place["at"]) + ": focus at " + NumberText(place, "position", 8, ", sigma ") +
                     NumberText(place, "sigma", 3, "");
  if (place["vergenceD"].is_number()) {
    text += " (" + NumberText(place, "vergenceD", 6, " D, sigma ") + NumberText(place, "sigmaD", 3, " D)");
  }
  if (!TextOf(place, "note").empty()) text += "\nnote: " + TextOf(place, "note");
  return text;
}

std::string SampleText(const Json& sample, std::size_t number) {
  std::string text = "  " + std::to_string(number) + "  " + PlaceText(sample["at"]) + ": " +
                     NumberText(sample, "position", 8, ", sigma ") + NumberText(sample, "sigma", 3, "");
  if (sample["off"].is_number()) text += ", off by " + NumberText(sample, "off", 3, "");
  if (sample.value("outlier", false)) text += ", OUTLIER: left out";
  if (sample["temperatureC"].is_number()) text += ", " + NumberText(sample, "temperatureC", 4, " C");
  if (sample["zoomPosition"].is_number()) text += ", zoom " + NumberText(sample, "zoomPosition", 6, "");
  if (sample["filterPosition"].is_number()) text += ", filter " + NumberText(sample, "filterPosition", 4, "");
  if (sample["fNumber"].is_number()) text += ", f/" + NumberText(sample, "fNumber", 3, "");
  return text + ", " + TextOf(sample, "made");
}

void ShowSurface(Session& session, const Json& surface) {
  std::string line = TextOf(surface, "lens") + ": ";
  if (surface.value("fitted", false)) {
    line += surface.value("curved", false) ? "a curved surface" : "a plane";
    line += " through " + std::to_string(surface["samples"].size()) + " samples from " + PlaceText(surface["low"]) +
            " to " + PlaceText(surface["high"]);
    line += ", scatter beyond their own sigmas " + NumberText(surface, "scatter", 3, "");
    if (surface.value("correction", 0.0) != 0.0) {
      line += ", corrected for the temperature by " + NumberText(surface, "correction", 3, "");
    }
  } else {
    line += TextOf(surface, "reason");
  }
  session.PrintText(line);
  std::size_t number = 0;
  for (const Json& sample : surface["samples"]) session.PrintText(SampleText(sample, ++number));
  if (!TextOf(surface, "note").empty()) session.PrintText("note: " + TextOf(surface, "note"));
  if (surface["next"].is_array()) session.PrintText("next: " + PlaceText(surface["next"]));
}

Outcome AddSample(Session& session, const FocusAtOptions& options) {
  const auto place = NeededPlaceIn(options.words);
  if (!place) return PassOn(place);
  Json parameters{{"lens", place->lens}, {"at", place->at}};
  for (const auto& [option, text] : {std::pair("position", options.position), std::pair("sigma", options.sigma)}) {
    if (text.empty()) continue;
    auto number = ParseNumber(text, std::string("--") + option);
    if (!number) return PassOn(number);
    parameters[option] = *number->Nearest();
  }
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  auto reply = link->Ask(MethodOfLens("FocusAtAdd"), parameters);
  if (!reply) return PassOn(reply);
  session.json() ? session.PrintJson((*reply)["surface"]) : ShowSurface(session, (*reply)["surface"]);
  return Exit::Done;
}

/// A lens without samples may have lost them with its calibration: what its status says of the files.
void ShowWarnings(Session& session, DaemonClient& link, const Json& lens) {
  const auto status = link.Ask(MethodOfLens("Status"), {{"lens", lens}});
  if (!status) return;
  for (const Json& each : status->at("lenses")) {
    for (const Json& warning : each["warnings"]) session.PrintText("note: " + warning.get<std::string>());
  }
}

Outcome ShowFocusAt(Session& session, const FocusAtOptions& options) {
  const auto place = PlaceIn(options.words);
  if (!place) return PassOn(place);
  Json parameters{{"lens", place->lens}};
  if (!place->at.empty()) parameters["at"] = place->at;
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  auto reply = link->Ask(MethodOfLens("FocusAtGet"), parameters);
  if (!reply) return PassOn(reply);
  if (session.json()) {
    session.PrintJson(*reply);
  } else if (!place->at.empty()) {
    session.PrintText(PredictionText((*reply)["place"]));
  } else {
    ShowSurface(session, (*reply)["surface"]);
    if ((*reply)["surface"]["samples"].empty()) ShowWarnings(session, *link, place->lens);
  }
  return Exit::Done;
}

Outcome GoToFocus(Session& session, const FocusAtOptions& options) {
  const auto place = NeededPlaceIn(options.words);
  if (!place) return PassOn(place);
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  auto reply = Drive(session, *link, MethodOfLens("FocusAt"), {{"lens", place->lens}, {"at", place->at}}, "focus");
  if (!reply) return PassOn(reply);
  const bool reached = (*reply)["move"].value("reached", false);
  if (session.json()) {
    session.PrintJson(*reply);
  } else {
    session.PrintText(PredictionText((*reply)["place"]));
    session.PrintText(MoveText((*reply)["move"]));
  }
  return reached ? Exit::Done : Exit::No;
}

Outcome ForgetSamples(Session& session, const FocusAtOptions& options) {
  const auto place = PlaceIn(options.words);
  if (!place) return PassOn(place);
  if (!place->at.empty()) return Refuse(Exit::Usage, "a sample is named by its number: --sample 3");
  Json parameters{{"lens", place->lens}};
  if (options.sample > 0) parameters["sample"] = options.sample;
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  auto reply = link->Ask(MethodOfLens("FocusAtForget"), parameters);
  if (!reply) return PassOn(reply);
  const bool removed = reply->value("removed", true);
  session.json() ? session.PrintJson({{"removed", removed}})
                 : session.PrintText(!removed             ? "there is no focus surface to forget"
                                     : options.sample > 0 ? "forgot sample " + std::to_string(options.sample)
                                                          : "forgot the focus surface");
  return Exit::Done;
}

}  // namespace

void AddFocusAt(CLI::App& root, Run& run) {
  auto* command =
      root.add_subcommand("focus-at", "focus by the coordinates of a stage or turntable, learned from autofocus")
          ->group(kOnline);
  command->require_subcommand(1)->fallthrough();
  auto options = std::make_shared<FocusAtOptions>();
  const auto verb = [&](const char* name, const char* about, const char* words,
                        Outcome (*act)(Session&, const FocusAtOptions&)) {
    auto* added = command->add_subcommand(name, about)->fallthrough();
    added->add_option("words", options->words, words)->type_name("");
    added->callback(
        [&run, options, act] { run = [options, act](Session& session) { return act(session, *options); }; });
    return added;
  };
  verb("go", "move focus to the position of the learned surface at a place", "[NAME] COORDINATE=VALUE...", GoToFocus);
  auto* add = verb("add", "add the result of the newest autofocus as a sample at this place",
                   "[NAME] COORDINATE=VALUE...", AddSample);
  add->add_option("--position", options->position,
                  "native focus position at this place, instead of that of the newest autofocus")
      ->type_name("P");
  add->add_option("--sigma", options->sigma, "standard deviation of --position, in native units")->type_name("S");
  verb("show", "show the samples and the surface, or the focus position at a place; moves nothing",
       "[NAME] [COORDINATE=VALUE...]", ShowFocusAt);
  auto* forget = verb("forget", "forget the surface, or one sample", "[NAME]", ForgetSamples);
  forget->add_option("--sample", options->sample, "number of the sample, from 1")->check(CLI::Range(1, 30));
}

}  // namespace lensd::cli
