// exposure: what a lens' camera is set to and can be set to.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <chrono>
#include <memory>
#include <optional>
#include <string_view>

#include "cli/link/arguments.h"
#include "cli/link/daemon_client.h"
#include "cli/online/commands.h"
#include "cli/text/quantity.h"
#include "cli/text/texts.h"

namespace lensd::cli {
namespace {

using varlink::Json;

struct ExposureOptions {
  std::vector<std::string> words;
  std::string gain;
};

/// The number of a gain that is written as lensctl prints it, "6 dB".
std::optional<std::string> InDecibels(const std::string& gain) {
  const std::size_t number = gain.find_last_of("0123456789.") + 1;
  const std::size_t unit = std::min(gain.find_first_not_of(' ', number), gain.size());
  constexpr std::string_view kUnit = "db";
  const bool decibels = number > 0 && std::ranges::equal(gain.substr(unit), kUnit, {}, [](char letter) {
                          return static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
                        });
  return decibels ? std::optional(gain.substr(0, number)) : std::nullopt;
}

/// Names begin with a letter and times with a digit, so one word alone says which it is.
std::expected<Json, Failure> ExposureParameters(const ExposureOptions& options) {
  const bool one_name = options.words.size() == 1 && std::isalpha(static_cast<unsigned char>(options.words[0][0])) != 0;
  const NameAndValue given = one_name ? NameAndValue{options.words[0], ""} : SplitNameAndValue(options.words);
  Json parameters{{"lens", given.lens}};
  if (!given.value.empty()) {
    auto time = ParseTime(given.value, "the exposure time");
    if (!time) return PassOn(time);
    parameters["exposureMs"] = std::chrono::duration<double, std::milli>(*time).count();
  }
  if (!options.gain.empty()) {
    auto gain = ParseNumber(InDecibels(options.gain).value_or(options.gain), "--gain");
    if (!gain) return PassOn(gain);
    parameters["gain"] = *gain->Nearest();
  }
  return parameters;
}

/// "10 ms (0.001 to 100000 ms)", "gain 6 dB (0 to 24)".
std::string ExposureText(const Json& now) {
  const auto range = [&](const char* low, const char* high) {
    if (!now[low].is_number() || !now[high].is_number()) return std::string();
    return " (" + NumberText(now, low, 6, " to ") + NumberText(now, high, 6, ")");
  };
  const bool known = now["exposureMs"].is_number();
  std::string text =
      TextOf(now, "lens") + ": exposes " + (known ? NumberText(now, "exposureMs", 6, " ms") : "as it likes");
  text += now.value("canSetExposure", false) ? range("exposureMinMs", "exposureMaxMs") : ", fixed";
  if (!now.value("canSetGain", false)) return text + "; its gain cannot be set";
  const char* const unit = TextOf(now, "gainUnit") == "dB" ? " dB" : " of its own";
  return text + ", gain " + (now["gain"].is_number() ? NumberText(now, "gain", 6, unit) : "unknown") +
         range("gainMin", "gainMax");
}

Outcome Exposure(Session& session, const ExposureOptions& options) {
  auto parameters = ExposureParameters(options);
  if (!parameters) return PassOn(parameters);
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  if (InDecibels(options.gain)) {
    const auto now = link->Ask(MethodOfLens("GetExposure"), {{"lens", (*parameters)["lens"]}});
    if (!now) return PassOn(now);
    if (TextOf((*now)["exposure"], "gainUnit") != "dB") {
      return Refuse(Exit::Usage,
                    "--gain '" + options.gain +
                        "': this camera counts its gain in a unit of its own, not in dB: write a plain number");
    }
  }
  const bool sets = parameters->contains("exposureMs") || parameters->contains("gain");
  auto reply = link->Ask(MethodOfLens(sets ? "SetExposure" : "GetExposure"), *std::move(parameters));
  if (!reply) return PassOn(reply);
  const Json& now = (*reply)["exposure"];
  session.json() ? session.PrintJson(now) : session.PrintText(ExposureText(now));
  return Exit::Done;
}

}  // namespace

void AddExposure(CLI::App& root, Run& run) {
  auto options = std::make_shared<ExposureOptions>();
  auto* command = root.add_subcommand(
      "exposure", "show or set exposure time and gain of a lens' camera: exposure cam 8ms --gain 6");
  command->group(kOnline);
  command
      ->add_option(
          "words", options->words,
          "[NAME] [TIME]: exposure time with its unit, such as 8ms; without TIME and --gain the settings are shown")
      ->expected(0, 2)
      ->type_name("");
  command->add_option("--gain", options->gain, "gain in the camera's unit, such as 6, or 6dB where that is dB")
      ->type_name("G");
  command->callback([&run, options] { run = [options](Session& session) { return Exposure(session, *options); }; });
}

}  // namespace lensd::cli
