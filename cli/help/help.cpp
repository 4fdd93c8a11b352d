// Help in 80 columns, and complaints that say what may have been meant.
#include "cli/help/help.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <span>
#include <utility>

#include "base/nearest_word.h"
#include "cli/help/command_tree.h"
#include "cli/help/examples.h"
#include "cli/help/manual.h"

namespace lensd::cli {
namespace {

constexpr std::size_t kWidth = 80, kColumn = 26;

/// `text` in lines that end by kWidth; the first begins at `at`, the others at `indent`. A word longer than a line has
/// one.
std::string Wrapped(std::string_view text, std::size_t at, std::size_t indent) {
  std::string out;
  std::size_t column = at;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    const std::string_view word = text.substr(0, end);
    const bool begins = column == at && out.empty();
    if (!begins && column + 1 + word.size() > kWidth) {
      out += "\n" + std::string(indent, ' ');
      column = indent;
    } else if (!begins) {
      out += ' ';
      ++column;
    }
    out += word;
    column += word.size();
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return out + "\n";
}

std::string RowText(const Row& row) {
  std::string line = "  " + row.written;
  if (line.size() + 2 > kColumn) {
    line += "\n" + std::string(kColumn, ' ');
  } else {
    line.resize(kColumn, ' ');
  }
  return line + Wrapped(row.meaning, kColumn, kColumn);
}

std::string ExampleText(const Example& example) {
  return "  " + std::string(example.line) + "\n" + std::string(6, ' ') + Wrapped(example.why, 6, 6);
}

/// The innermost command that was reached, and its whole name.
std::pair<const CLI::App*, std::string> Reached(const CLI::App& root) {
  const CLI::App* command = &root;
  std::string name = root.get_name();
  while (!command->get_subcommands().empty()) {
    command = command->get_subcommands().front();
    name += " " + command->get_name();
  }
  return {command, name};
}

std::string Meant(const std::string& typed, const std::vector<std::string>& words) {
  const auto meant = NearestWord(typed, words);
  return meant ? " (did you mean " + *meant + "?)" : "";
}

/// What other programs call a command of ours; empty for anything else.
std::string_view OtherNameOf(std::string_view word) {
  static constexpr std::pair<std::string_view, std::string_view> kOthers[] = {
      {"iris", "aperture"}, {"fstop", "aperture"}, {"f-number", "aperture"},  {"diaphragm", "aperture"},
      {"af", "autofocus"},  {"photo", "snapshot"}, {"picture", "snapshot"},   {"capture", "snapshot"},
      {"goto", "focus"},    {"move", "focus"},     {"info", "status"},        {"position", "status"},
      {"halt", "stop"},     {"abort", "stop"},     {"depth-of-field", "dof"}, {"scan", "devices"}};
  const auto* found = std::ranges::find(kOthers, word, &std::pair<std::string_view, std::string_view>::first);
  return found == std::end(kOthers) ? std::string_view() : found->second;
}

/// Whether the word is a unit alone, which the shell has parted from its number.
bool IsUnit(const std::string& word) {
  static constexpr std::string_view kSymbols[] = {"nm", "um", "mm", "cm", "m",  "km", "in",  "ft",
                                                "D",  "px", "ns", "us", "ms", "s",  "min", "h"};
  return std::ranges::find(kSymbols, word) != std::end(kSymbols);
}

/// What to say of a word where a command is meant.
std::string NoCommand(const CLI::App& command, const std::vector<std::string>& words, const std::string& has,
                      const std::string& help) {
  const std::string& typed = words.front();
  const std::string name(OtherNameOf(typed));
  const bool lensctl = command.get_parent() == nullptr;
  if (lensctl && !name.empty()) {
    std::string line = "lensctl " + name;
    for (const std::string& word : std::span(words).subspan(1)) line += " " + word;
    return "there is no command '" + typed + "': write " + line + help;
  }
  const auto meant = NearestWord(typed, SubcommandNames(command));
  const std::string order = lensctl && !meant ? "; the name of a lens stands after the command" : "";
  return "there is no command '" + typed + "'" + (meant ? " (did you mean " + *meant + "?)" : "") + order + has + help;
}

/// A complaint about the words of a command for one lens, in whose place CLI11 only knows "words".
std::optional<std::string> ComplaintOfWords(const CLI::App& command, const std::string& name, const std::string& said) {
  if (!said.starts_with("words")) return std::nullopt;
  for (const CLI::Option* option : command.get_options()) {
    if (!option->get_positional()) continue;
    const std::string meaning = PositionalMeaning(*option);
    return "write " + name + " " + PositionalText(*option) + (meaning.empty() ? "" : ", " + meaning);
  }
  return std::nullopt;
}

/// The command that `words` name, or what to say instead.
struct Named {
  const CLI::App* command = nullptr;
  std::string name;
};

std::expected<Named, Failure> Find(const CLI::App& root, const std::vector<std::string>& words) {
  Named named{&root, root.get_name()};
  for (const std::string& word : words) {
    const CLI::App* const next = SubcommandOf(*named.command, word);
    if (next == nullptr) {
      return Refuse(Exit::Usage, named.name + " has no command '" + word + "'" +
                                     Meant(word, SubcommandNames(*named.command)) + "; see lensctl help");
    }
    named = {next, named.name + " " + word};
  }
  return named;
}

}  // namespace

std::string HelpText(const CLI::App& command, const std::string& name) {
  const CommandText text = Describe(command, name);
  std::string out = Wrapped(text.about, 0, 0) + "\nUsage: " + text.usage + "\n";
  for (const Section& section : text.sections) {
    out += "\n" + section.title + ":\n";
    for (const Row& row : section.rows) out += RowText(row);
  }
  std::string footer = text.footer;
  std::ranges::replace(footer, '\n', ' ');
  if (!footer.empty()) out += "\n" + Wrapped(footer, 0, 0);
  if (!text.examples.empty()) out += "\nExamples:\n";
  for (const Example& example : text.examples) out += ExampleText(example);
  return out;
}

Failure UsageFailure(const CLI::App& root, const CLI::ParseError& error) {
  const auto [command, name] = Reached(root);
  const std::string help = "; see " + name + " --help";
  const auto unknown = root.remaining(true);  // options that a command does not know fall through to the root
  if (!unknown.empty() && unknown.front().starts_with("-")) {
    const std::string option = unknown.front().substr(0, unknown.front().find('='));
    return {Exit::Usage, name + " has no option " + option + Meant(option, OptionNames(*command)) + help};
  }
  const auto commands = SubcommandNames(*command);
  if (!commands.empty() && command->get_subcommands().empty()) {
    // Of a group of a few all are named; lensctl's own fill a screen.
    std::string has;
    if (command != &root) {
      for (const std::string& one : commands) has.append(has.empty() ? ": " + name + " has " : ", ").append(one);
    }
    if (unknown.empty()) return {Exit::Usage, "say which command" + has + help};
    return {Exit::Usage, NoCommand(*command, unknown, has, help)};
  }
  if (!unknown.empty() && IsUnit(unknown.front())) {
    return {Exit::Usage, "'" + unknown.front() + "' stands alone: a number and its unit are one word, such as 1.2" +
                             unknown.front() + help};
  }
  const std::string said = unknown.empty() ? error.what() : name + " takes no '" + unknown.front() + "'";
  const auto examples = ExamplesOf(name);
  const std::string example = examples.empty() ? "" : "; for example: " + std::string(examples.front().line);
  return {Exit::Usage, ComplaintOfWords(*command, name, said).value_or(said) + example + help};
}

bool NamesNoCommand(const CLI::App& root) {
  const CLI::App* const command = Reached(root).first;
  const auto unknown = root.remaining(true);
  return !unknown.empty() && !unknown.front().starts_with("-") && !SubcommandNames(*command).empty();
}

void AddHelp(CLI::App& root, Run& run) {
  struct Wanted {
    std::vector<std::string> words;
    bool roff = false;
  };
  auto wanted = std::make_shared<Wanted>();
  auto* command = root.add_subcommand("help", "this text, or the help of one command")->group(kPlumbing);
  command->add_option("words", wanted->words, "[COMMAND]: a command, or a subcommand of it, as in `preset save`")
      ->expected(0, 2)
      ->type_name("");
  command->add_flag("--roff", wanted->roff, "all commands as a manual page: lensctl help --roff > lensctl.1");
  command->callback([&run, &root, wanted] {
    run = [&root, wanted](Session& session) -> Outcome {
      if (wanted->roff) {
        session.PrintText(ManualPage(root));
        return Exit::Done;
      }
      const auto named = Find(root, wanted->words);
      if (!named) return PassOn(named);
      session.PrintText(HelpText(*named->command, named->name));
      return Exit::Done;
    };
  });
}

}  // namespace lensd::cli
