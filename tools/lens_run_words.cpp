// The words of lens-run's command line, read into a script before any device is opened, so that a mistake costs
// nothing.
#include "lens_run_words.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include "io/toml.h"

namespace lensd::tools {
namespace {

struct Form {
  std::string_view name;
  std::size_t words;
  std::string_view usage;
};
constexpr Form kForms[] = {
    {"list", 0, "list                what the device is and can do"},
    {"read", 0, "read                where every axis is"},
    {"home", 1, "home AXIS           search for the axis' reference, until it rests"},
    {"move", 2, "move AXIS TARGET    go to TARGET in native units, until it rests"},
    {"start", 2, "start AXIS TARGET   move without waiting"},
    {"stop", 1, "stop AXIS           end a motion where it is"},
    {"wait", 1, "wait SECONDS        let time pass"},
    {"expose", 1, "expose MS           set the exposure time"},
    {"grab", 1, "grab FILE.png       one frame into a file"},
    {"frames", 1, "frames N            stream N frames, and say when each was exposed"},
};

/// TOML where it is TOML ("5", "true", "[0, 10]"), else text ("/dev/video0").
Result<Settings> SettingsFromPairs(const std::vector<std::pair<std::string, std::string>>& pairs) {
  std::string text;
  for (const auto& [key, value] : pairs) {
    const std::string name = key + " = ";
    std::string plain = name, quoted = name + "\"";
    plain.append(value).append("\n");
    for (const char c : value) quoted += (c == '"' || c == '\\') ? std::string("\\") + c : std::string(1, c);
    quoted += "\"\n";
    text += io::ParseToml(plain, "").has_value() ? plain : quoted;
  }
  // Paths are relative to where lens-run is, as if a file here said so.
  return io::ParseToml(text, "argument");
}

}  // namespace

Result<Script> ReadScript(const std::vector<std::string>& arguments) {
  Script script;
  std::vector<std::pair<std::string, std::string>> pairs;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& word = arguments[i];
    const auto equals = word.find('=');
    if (word.starts_with("--timeout=")) {
      const std::string value = word.substr(equals + 1);
      const auto end = value.data() + value.size();
      const auto [rest, error] = std::from_chars(value.data(), end, script.timeout_s);
      if (error != std::errc() || rest != end || !(script.timeout_s > 0.0 && script.timeout_s < 1e6)) {
        return Fail(Code::InvalidArgument, "--timeout takes seconds above 0, not " + value);
      }
    } else if (word.starts_with("-") && script.commands.empty()) {
      return Fail(Code::InvalidArgument, "there is no option " + word + "; see lens-run --help");
    } else if (script.driver.empty()) {
      script.driver = word;
    } else if (script.commands.empty() && equals != std::string::npos) {
      pairs.emplace_back(word.substr(0, equals), word.substr(equals + 1));
    } else {
      const auto* form = std::ranges::find(kForms, word, &Form::name);
      if (form == std::end(kForms)) {
        return Fail(Code::InvalidArgument, "\"" + word + "\" is no command; see lens-run --help");
      }
      if (arguments.size() - i - 1 < form->words) {
        return Fail(Code::InvalidArgument, "too few words: " + std::string(form->usage));
      }
      const auto begin = arguments.begin() + static_cast<std::ptrdiff_t>(i) + 1;
      script.commands.push_back({word, {begin, begin + static_cast<std::ptrdiff_t>(form->words)}});
      i += form->words;
    }
  }
  auto settings = SettingsFromPairs(pairs);
  if (!settings) return Fail(Code::InvalidArgument, settings.error().message);
  script.settings = std::move(*settings);
  if (script.commands.empty()) script.commands.push_back({"list", {}});
  return script;
}

std::string HelpText() {
  std::string text =
      "lens-run: drives one lens or camera through its driver alone, without lensd\n\n"
      "  lens-run                                   the drivers, and what is plugged in\n"
      "  lens-run [--timeout=S] DRIVER [KEY=VALUE]... [COMMAND]...\n\n"
      "Keys are those of the driver's [[lens]] or [lens.camera] section (docs/drivers/). Commands, done in order\n"
      "(default: list):\n";
  for (const Form& form : kForms) text += "  " + std::string(form.usage) + "\n";
  text +=
      "\nFor instance: lens-run sim scene=scenes/brick.toml move focus 4000 grab brick.png\n"
      "The device must be free: stop lensd first. Ctrl-C stops what moves.\n"
      "Exit status: 0, or as in sysexits.h: 64 usage, 69 no such device, 74 input or output, 75 too late or stopped,\n"
      "76 protocol, 78 configuration.\n";
  return text;
}

}  // namespace lensd::tools
