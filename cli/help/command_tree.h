// lensctl's commands as the parser knows them, read again for help, manual page and completion, so that none of these
// can leave out or invent an option.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace lensd::cli {

/// One row of a list: what is written, and what it means.
struct Row {
  std::string written;
  std::string meaning;
};

/// Rows under one title.
struct Section {
  std::string title;
  std::vector<Row> rows;
};

/// Something to type, as it is typed, and what it is good for.
struct Example {
  std::string_view line;
  std::string_view why;
};

/// Everything that is known of one command.
struct CommandText {
  std::string name;   ///< "lensctl focus"
  std::string about;  ///< without a full stop
  std::string usage;  ///< "lensctl focus [OPTIONS] [NAME] TARGET"
  std::vector<Section> sections;
  std::string footer;
  std::vector<Example> examples;
};

/// Of `command`, which is reached by `name`.
CommandText Describe(const CLI::App& command, const std::string& name);

/// What a positional is called on the usage line: "[NAME] TARGET", "METHOD", "[JSON]".
std::string PositionalText(const CLI::Option& option);
/// "what it is: how it is written" of a positional without that name.
std::string PositionalMeaning(const CLI::Option& option);

/// The sub-command of this name, or nullptr.
const CLI::App* SubcommandOf(const CLI::App& command, std::string_view name);
/// The names of all its sub-commands.
std::vector<std::string> SubcommandNames(const CLI::App& command);
/// The long options, "--json" and the like, of a command and of those around it.
std::vector<std::string> OptionNames(const CLI::App& command);

}  // namespace lensd::cli
