// completion: a few lines of script for each shell, which ask lensctl itself what may stand in a place. So a new option
// or lens needs no new script.
#include "cli/help/completion.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <memory>

#include "cli/help/command_tree.h"
#include "cli/link/daemon_client.h"
#include "cli/online/commands.h"
#include "proto/interfaces.h"

namespace lensd::cli {
namespace {

using varlink::Json;

constexpr std::string_view kBash = R"(# lensctl in bash: source <(lensctl completion bash)
_lensctl() {
  local IFS=$'\n'
  COMPREPLY=($(lensctl completion words "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null))
}
complete -o default -F _lensctl lensctl
)";

constexpr std::string_view kZsh = R"(#compdef lensctl
# lensctl in zsh: put this into a folder of $fpath as _lensctl, or source <(lensctl completion zsh) after compinit
_lensctl() {
  local -a offered
  offered=("${(@f)$(lensctl completion words "${(@)words[2,CURRENT]}" 2>/dev/null)}")
  if [[ -n "${offered[1]}" ]]; then
    compadd -- "${offered[@]}"
  else
    _files
  fi
}
if [[ "$funcstack[1]" == _lensctl ]]; then
  _lensctl "$@"
else
  compdef _lensctl lensctl
fi
)";

constexpr std::string_view kFish =
    R"(# lensctl in fish: lensctl completion fish > ~/.config/fish/completions/lensctl.fish
complete -c lensctl -f -a '(lensctl completion words (commandline -opc)[2..-1] (commandline -ct) 2>/dev/null)'
complete -c lensctl -l socket -r -F
complete -c lensctl -s o -r -F
)";

/// The daemon that the line so far names.
Globals GlobalsOf(std::span<const std::string> words) {
  Globals globals;
  globals.timeout = std::chrono::milliseconds(500);
  if (const char* const variable = std::getenv("LENSD_SOCKET"); variable != nullptr && *variable != 0) {
    globals.socket = variable;
  }
  for (std::size_t i = 0; i + 1 < words.size(); ++i) {
    if (words[i] == "--socket") globals.socket = words[i + 1];
    if (words[i] == "--rig") globals.socket = proto::RigSocket(words[i + 1]);
  }
  return globals;
}

/// Nothing where no daemon answers: a shell that waits is worse than one that offers nothing.
Json Asked(std::span<const std::string> words, std::string_view method, Json parameters) {
  const Session session(GlobalsOf(words));
  auto link = DaemonClient::Open(session);
  if (!link) return Json::object();
  return link->Ask(method, std::move(parameters)).value_or(Json::object());
}

std::vector<std::string> TextsOf(const Json& objects, const char* key) {
  std::vector<std::string> texts;
  for (const Json& object : objects) texts.push_back(object.value(key, ""));
  return texts;
}

std::vector<std::string> Lenses(std::span<const std::string> words) {
  const Json reply = Asked(words, MethodOfLens("List"), Json::object());
  return TextsOf(reply.value("lenses", Json::array()), "name");
}

std::vector<std::string> Presets(std::span<const std::string> words, const Json& lens) {
  const Json reply = Asked(words, MethodOfLens("PresetList"), {{"lens", lens}});
  return TextsOf(reply.value("presets", Json::array()), "label");
}

std::vector<std::string> Methods(std::span<const std::string> words) {
  const Json reply =
      Asked(words, "org.varlink.service.GetInterfaceDescription", {{"interface", proto::kLensInterface}});
  std::vector<std::string> methods;
  const std::string text = reply.value("description", "");
  constexpr std::string_view kMethod = "\nmethod ";
  for (std::size_t at = text.find(kMethod); at != text.npos; at = text.find(kMethod, at + 1)) {
    const std::size_t begin = at + kMethod.size();
    methods.push_back(text.substr(begin, text.find('(', begin) - begin));
  }
  return methods;
}

/// The command that the words before the last one reach, and how many of its own words are there.
struct Place {
  const CLI::App* command;
  std::vector<std::string> own = {};
  const CLI::Option* option = nullptr;  ///< whose value comes next
};

const CLI::Option* OptionCalled(const CLI::App* command, const std::string& word) {
  for (; command != nullptr; command = command->get_parent()) {
    const std::string bare = word.substr(word.find_first_not_of('-'));
    const auto options = command->get_options([&](const CLI::Option* option) {
      return option->nonpositional() && (option->check_lname(bare) || option->check_sname(bare));
    });
    if (!options.empty()) return options.front();
  }
  return nullptr;
}

Place PlaceOf(const CLI::App& root, std::span<const std::string> words) {
  Place place{&root};
  for (const std::string& word : words.first(words.size() - 1)) {
    if (place.option != nullptr) {
      place.option = nullptr;
    } else if (word.size() > 1 && word.starts_with('-') && word.find_first_not_of('-') != word.npos) {
      const CLI::Option* const option = OptionCalled(place.command, word);
      if (option != nullptr && option->get_expected_max() > 0 && word.find('=') == word.npos) place.option = option;
    } else if (const CLI::App* const next = SubcommandOf(*place.command, word)) {
      place.command = next;
    } else {
      place.own.push_back(word);
    }
  }
  return place;
}

/// The choices that an option has, of its type "TEXT:{a,b}" or its own words "a, b or c".
std::vector<std::string> ValuesOf(const CLI::Option& option) {
  const std::string name = option.get_name(false, true);
  if (name == "--units") return {"m", "mm", "ft", "in", "D"};
  if (name == "--from") return {"lens", "sensor", "front"};
  std::vector<std::string> values;
  const std::string type = option.get_type_name();
  const std::size_t open = type.find('{');
  if (open == type.npos) return values;
  for (std::size_t at = open + 1; at < type.size();) {
    const std::size_t end = type.find_first_of(",}", at);
    values.push_back(type.substr(at, end - at));
    at = end + 1;
  }
  return values;
}

std::vector<std::string> ArgumentsOf(const CLI::App& root, const Place& place, std::span<const std::string> words) {
  std::string text;
  for (const CLI::Option* option : place.command->get_options()) {
    if (option->get_positional()) text += PositionalText(*option) + " ";
  }
  const auto takes = [&](std::string_view what) { return text.find(what) != text.npos; };
  if (takes("COMMAND")) {
    const CLI::App* const command = place.own.empty() ? &root : SubcommandOf(root, place.own.front());
    return command == nullptr ? std::vector<std::string>{} : SubcommandNames(*command);
  }
  if (takes("SHELL")) return {"bash", "zsh", "fish"};
  if (takes("METHOD")) return place.own.empty() ? Methods(words) : std::vector<std::string>{};
  std::vector<std::string> offered;
  if (takes("NAME") && place.own.empty()) offered = Lenses(words);
  if (takes("LABEL") && place.own.size() < 2) {
    std::ranges::move(Presets(words, place.own.empty() ? Json(nullptr) : Json(place.own.front())),
                      std::back_inserter(offered));
  }
  if (takes("AXIS") && place.own.size() < 2) offered.insert(offered.end(), {"focus", "iris", "zoom", "filter"});
  if (takes("STATE") && place.own.size() < 2) offered.insert(offered.end(), {"idle", "connected", "homed"});
  return offered;
}

}  // namespace

std::vector<std::string> Completions(const CLI::App& root, std::span<const std::string> words) {
  if (words.empty()) return {};
  const std::string& typed = words.back();
  const Place place = PlaceOf(root, words);
  std::vector<std::string> offered;
  if (place.option != nullptr) {
    offered = ValuesOf(*place.option);
  } else if (typed.starts_with('-')) {
    offered = OptionNames(*place.command);
  } else if (!place.command->get_subcommands({}).empty()) {
    offered = SubcommandNames(*place.command);
  } else {
    offered = ArgumentsOf(root, place, words);
  }
  std::erase_if(offered, [&](const std::string& word) { return !word.starts_with(typed); });
  return offered;
}

void AddCompletion(CLI::App& root, Run& run) {
  auto shell = std::make_shared<std::string>();
  auto* command = root.add_subcommand("completion", "print the script that lets a shell complete lensctl's commands")
                      ->group(kPlumbing);
  command->add_option("SHELL", *shell, "bash, zsh or fish")->required()->type_name("");
  command->callback([&run, shell] {
    run = [shell](Session& session) -> Outcome {
      for (const auto& [name, script] : {std::pair("bash", kBash), std::pair("zsh", kZsh), std::pair("fish", kFish)}) {
        if (*shell != name) continue;
        session.PrintText(script);
        return Exit::Done;
      }
      return Refuse(Exit::Usage, "SHELL '" + *shell + "': say bash, zsh or fish");
    };
  });
}

}  // namespace lensd::cli
