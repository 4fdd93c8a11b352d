// From CLI11's options to rows of text. Commands for one lens take their words together ("[NAME] TARGET: a distance"),
// because which of two words is missing only they can tell; such a positional is described by its own text.
#include "cli/help/command_tree.h"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "cli/help/examples.h"

namespace lensd::cli {
namespace {

constexpr std::string_view kWords = "words";

/// CLI11 writes ranges and choices behind a colon; they are part of what an option means here.
Row OptionRow(const CLI::Option& option) {
  Row row{option.get_name(false, true), option.get_description()};
  for (std::size_t at = row.written.find(','); at != row.written.npos; at = row.written.find(',', at + 2)) {
    row.written.insert(at + 1, " ");
  }
  if (option.get_expected_max() != 0) {
    const std::string type = option.get_type_name();
    const std::size_t colon = type.find(':');
    const std::string shown = type.substr(0, colon);
    row.written += " " + (shown == "INT" || shown == "FLOAT" || shown == "UINT" ? "N" : shown);
    if (option.get_expected_max() > 1) row.written += " ...";
    if (const std::size_t range = type.find(" in ["); range != type.npos)
      row.meaning += "; from" + type.substr(range + 3);
  }
  if (!option.get_default_str().empty()) row.meaning += " (default " + option.get_default_str() + ")";
  if (option.get_required()) row.meaning += " (required)";
  return row;
}

std::vector<const CLI::Option*> Positionals(const CLI::App& command) {
  return command.get_options([](const CLI::Option* option) { return option->get_positional(); });
}

std::vector<const CLI::Option*> OptionsOf(const CLI::App& command, const std::string& group) {
  return command.get_options(
      [&](const CLI::Option* option) { return option->nonpositional() && option->get_group() == group; });
}

Section Arguments(const CLI::App& command) {
  Section section{"Arguments", {}};
  for (const CLI::Option* option : Positionals(command)) {
    section.rows.push_back({PositionalText(*option), PositionalMeaning(*option)});
  }
  std::erase_if(section.rows, [](const Row& row) { return row.meaning.empty(); });
  return section;
}

std::vector<Section> Subcommands(const CLI::App& command) {
  std::vector<Section> sections;
  for (const CLI::App* each : command.get_subcommands({})) {
    const std::string title = command.get_parent() == nullptr ? each->get_group() : "Commands";
    auto section = std::ranges::find(sections, title, &Section::title);
    if (section == sections.end()) section = sections.insert(section, {title, {}});
    section->rows.push_back({each->get_name(), each->get_description()});
  }
  return sections;
}

std::string Usage(const CLI::App& command, const std::string& name) {
  std::string usage = name + " [OPTIONS]";
  if (!command.get_subcommands({}).empty()) usage += " COMMAND";
  for (const CLI::Option* option : Positionals(command)) usage += " " + PositionalText(*option);
  return usage;
}

}  // namespace

std::string PositionalText(const CLI::Option& option) {
  const std::string name = option.get_name(true);
  if (name == kWords) return option.get_description().substr(0, option.get_description().find(':'));
  return option.get_required() ? name : "[" + name + "]";
}

std::string PositionalMeaning(const CLI::Option& option) {
  const std::string& about = option.get_description();
  if (option.get_name(true) != kWords) return about;
  const std::size_t colon = about.find(": ");
  return colon == about.npos ? "" : about.substr(colon + 2);
}

CommandText Describe(const CLI::App& command, const std::string& name) {
  CommandText text{.name = name,
                   .about = command.get_description(),
                   .usage = Usage(command, name),
                   .sections = {Arguments(command)},
                   .footer = command.get_footer(),
                   .examples = ExamplesOf(name)};
  for (Section& section : Subcommands(command)) text.sections.push_back(std::move(section));
  for (const std::string& group : command.get_groups()) {
    Section section{group == "Global" ? "Options of every command" : group, {}};
    for (const CLI::Option* option : OptionsOf(command, group)) section.rows.push_back(OptionRow(*option));
    text.sections.push_back(std::move(section));
  }
  std::erase_if(text.sections, [](const Section& section) { return section.rows.empty(); });
  return text;
}

const CLI::App* SubcommandOf(const CLI::App& command, std::string_view name) {
  const auto all = command.get_subcommands({});
  const auto found = std::ranges::find_if(all, [&](const CLI::App* each) { return each->get_name() == name; });
  return found == all.end() ? nullptr : *found;
}

std::vector<std::string> SubcommandNames(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::App* each : command.get_subcommands({})) names.push_back(each->get_name());
  return names;
}

std::vector<std::string> OptionNames(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::App* each = &command; each != nullptr; each = each->get_parent()) {
    for (const CLI::Option* option : each->get_options()) {
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    }
  }
  std::ranges::sort(names);
  names.erase(std::ranges::unique(names).begin(), names.end());
  return names;
}

}  // namespace lensd::cli
