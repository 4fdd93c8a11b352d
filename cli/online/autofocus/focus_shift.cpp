// focus-shift measure, list, remove; and the options of a search's own conditions, which autofocus has too.
#include <CLI/CLI.hpp>
#include <chrono>
#include <memory>
#include <tuple>

#include "cli/link/arguments.h"
#include "cli/link/drive.h"
#include "cli/link/progress.h"
#include "cli/link/target.h"
#include "cli/online/autofocus/autofocus.h"
#include "cli/online/commands.h"
#include "cli/text/quantity.h"
#include "cli/text/text.h"
#include "cli/text/texts.h"

namespace lensd::cli {
namespace {

using varlink::Json;

/// "f/2.8 to f/8", "filter 3 to filter 1".
std::string ShiftPairText(const Json& shift) {
  if (shift["fromFNumber"].is_number()) {
    return "f/" + NumberText(shift, "fromFNumber", 4, " to f/") + NumberText(shift, "toFNumber", 4, "");
  }
  return "filter " + NumberText(shift, "fromFilter", 4, " to filter ") + NumberText(shift, "toFilter", 4, "");
}

std::string ShiftText(const Json& shift) {
  std::string text = ShiftPairText(shift);
  if (shift["focalLengthMm"].is_number()) text += " at " + NumberText(shift, "focalLengthMm", 5, " mm");
  text += ": " + ShiftSizeText(shift["shift"]);
  if (shift.value("pairs", 0) > 0) text += ", by " + NumberText(shift, "pairs", 4, " pairs of searches");
  const std::string made = TextOf(shift, "made");
  return text + (made.empty() ? "" : ", " + made);
}

struct ShiftOptions {
  std::string name;
  ConditionTexts conditions;
  std::string region;
  int pairs = 0;
};

std::expected<Json, Failure> ParametersOf(const ShiftOptions& options) {
  Json parameters{{"lens", LensOf(options.name)}};
  if (options.conditions.f_number.empty() == options.conditions.filter.empty()) {
    return std::unexpected(
        Failure(Exit::Usage, "give exactly one of --f-number and --filter: their shifts are measured separately"));
  }
  auto conditions = ConditionsOf(options.conditions);
  if (!conditions) return PassOn(conditions);
  parameters["conditions"] = *std::move(conditions);
  if (!options.region.empty()) {
    auto region = ParseRegion(options.region, "--roi");
    if (!region) return PassOn(region);
    parameters["region"] = *std::move(region);
  }
  if (options.pairs > 0) parameters["pairs"] = options.pairs;
  return parameters;
}

Outcome MeasureShift(Session& session, const ShiftOptions& options) {
  auto parameters = ParametersOf(options);
  if (!parameters) return PassOn(parameters);
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  const Json lens = (*parameters)["lens"];
  ProgressLine line(session);
  const auto show = [&](const Json& part) {
    if (!part.contains("progress") || !part["progress"].is_object()) return true;
    const Json& now = part["progress"];
    line.Show("search " + NumberText(now, "search", 4, " of ") + NumberText(now, "searchesExpected", 4, ", ") +
              NumberText(now, "frames", 6, " frames"));
    return true;
  };
  auto reply = link->Follow(MethodOfLens("MeasureFocusShift"), *std::move(parameters), show, [&] {
    line.Clear();
    StopAndTell(session, lens, "focus");
  });
  line.Clear();
  if (!reply) return PassOn(reply);
  const Json& result = (*reply)["shift"];
  const bool measured = result.value("measured", false);
  if (session.json()) {
    session.PrintJson(result);
  } else {
    session.PrintText(TextOf(result, "lens") + ": " +
                      (measured ? ShiftText(result["shift"]) : "not measured: " + TextOf(result, "reason")));
  }
  return measured ? Exit::Done : Exit::No;
}

Outcome ListShifts(Session& session, const std::string& name) {
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  auto reply = link->Ask(MethodOfLens("ListFocusShifts"), {{"lens", LensOf(name)}});
  if (!reply) return PassOn(reply);
  const Json& shifts = (*reply)["shifts"];
  if (session.json()) {
    session.PrintJson(shifts);
    return Exit::Done;
  }
  for (const Json& shift : shifts) session.PrintText(ShiftText(shift));
  if (shifts.empty()) session.PrintText("no shift of focus is measured");
  return Exit::Done;
}

struct ShiftPairOptions {
  std::string name;
  std::string from;
  std::string to;
};

/// f/2.8 is an f-number, a bare number a filter.
Outcome RemoveShift(Session& session, const ShiftPairOptions& options) {
  Json parameters{{"lens", LensOf(options.name)}};
  const bool openings = options.from.starts_with("f/");
  if (openings != options.to.starts_with("f/")) {
    return Refuse(Exit::Usage,
                  "--from and --to are two f-numbers, such as f/2.8 and f/8, or two filters, such as 3 and 1");
  }
  for (const auto& [option, text, key] : {std::tuple("--from", options.from, openings ? "fromFNumber" : "fromFilter"),
                                          std::tuple("--to", options.to, openings ? "toFNumber" : "toFilter")}) {
    auto number = openings ? ParseFNumber(text, option) : ParseNumber(text, option);
    if (!number) return PassOn(number);
    parameters[key] = *number->Nearest();
  }
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  auto reply = link->Ask(MethodOfLens("RemoveFocusShift"), parameters);
  if (!reply) return PassOn(reply);
  session.json() ? session.PrintJson({{"removed", true}})
                 : session.PrintText("removed the shift from " + options.from + " to " + options.to);
  return Exit::Done;
}

}  // namespace

void AddConditionOptions(CLI::App& command, ConditionTexts& texts) {
  command.add_option("--exposure", texts.exposure, "exposure time during the search only, such as 5ms")
      ->type_name("TIME");
  command.add_option("--gain", texts.gain, "gain during the search only, in the camera's unit")->type_name("G");
  command
      .add_option(
          "--f-number", texts.f_number,
          "f-number during the search only, such as 2.8; the exposure does not follow it, so give --exposure too")
      ->type_name("N");
  command.add_option("--filter", texts.filter, "filter wheel position during the search only")->type_name("K");
}

Result<Json> ConditionsOf(const ConditionTexts& texts) {
  Json conditions = Json::object();
  if (!texts.exposure.empty()) {
    auto time = ParseTime(texts.exposure, "--exposure");
    if (!time) return PassOn(time);
    conditions["exposureMs"] = std::chrono::duration<double, std::milli>(*time).count();
  }
  if (!texts.gain.empty()) {
    auto gain = ParseNumber(texts.gain, "--gain");
    if (!gain) return PassOn(gain);
    conditions["gain"] = *gain->Nearest();
  }
  if (!texts.f_number.empty()) {
    auto f_number = ParseFNumber(texts.f_number, "--f-number");
    if (!f_number) return PassOn(f_number);
    conditions["fNumber"] = *f_number->Nearest();
  }
  if (!texts.filter.empty()) {
    auto filter = ParseNumber(texts.filter, "--filter");
    if (!filter) return PassOn(filter);
    conditions["filterPosition"] = *filter->Nearest();
  }
  return conditions;
}

void AddFocusShift(CLI::App& root, Run& run) {
  auto* command =
      root.add_subcommand("focus-shift", "measure how f-number and filter shift focus, for autofocus")->group(kOnline);
  command->require_subcommand(1)->fallthrough();
  auto options = std::make_shared<ShiftOptions>();
  auto* measure = command->add_subcommand(
      "measure", "search with and without a condition, in turn; the difference is the focus shift");
  measure->fallthrough();
  measure->add_option("NAME", options->name, "lens");
  AddConditionOptions(*measure, options->conditions);
  measure->add_option("--roi", options->region, "region as fractions of the frame, the camera's own when left out")
      ->type_name("X,Y,W,H");
  measure->add_option("--pairs", options->pairs, "pairs of searches (default 5); more pairs give a smaller error")
      ->check(CLI::Range(3, 20));
  measure->callback([&run, options] { run = [options](Session& session) { return MeasureShift(session, *options); }; });

  auto name = std::make_shared<std::string>();
  auto* list = command->add_subcommand("list", "list the measured focus shifts of a lens")->fallthrough();
  list->add_option("NAME", *name, "lens");
  list->callback([&run, name] { run = [name](Session& session) { return ListShifts(session, *name); }; });

  auto pair = std::make_shared<ShiftPairOptions>();
  auto* remove =
      command->add_subcommand("remove", "forget the shift between two f-numbers or filters, in either direction");
  remove->fallthrough();
  remove->add_option("NAME", pair->name, "lens");
  remove->add_option("--from", pair->from, "an f-number as f/2.8, or a filter wheel position")
      ->required()
      ->type_name("WHICH");
  remove->add_option("--to", pair->to, "the other f-number or filter wheel position")->required()->type_name("WHICH");
  remove->callback([&run, pair] { run = [pair](Session& session) { return RemoveShift(session, *pair); }; });
}

}  // namespace lensd::cli
