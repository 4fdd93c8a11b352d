// lensctl(1): the sections of a manual page from the same rows as the help.
#include "cli/help/manual.h"

#include <CLI/CLI.hpp>

#include "cli/help/command_tree.h"

namespace lensd::cli {
namespace {

/// roff reads a backslash, and a dot or a quote at the beginning of a line, as its own; a plain - may become a hyphen.
std::string Roff(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n')) out += "\\&";
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else {
      out += c;
    }
  }
  return out;
}

std::string Rows(const std::vector<Row>& rows) {
  std::string out;
  for (const Row& row : rows) out += ".TP\n.B " + Roff(row.written) + "\n" + Roff(row.meaning) + "\n";
  return out;
}

std::string Examples(const std::vector<Example>& examples) {
  std::string out;
  for (const Example& example : examples) {
    out += ".TP\n.nh\n.B " + Roff(example.line) + "\n.hy\n" + Roff(example.why) + "\n";
  }
  return out;
}

std::string CommandSection(const CLI::App& command, const std::string& name) {
  const CommandText text = Describe(command, name);
  std::string out = ".SS " + Roff(text.usage) + "\n" + Roff(text.about) + "\n";
  for (const Section& section : text.sections) {
    if (section.title != "Commands") out += Rows(section.rows);
  }
  if (!text.footer.empty()) out += ".PP\n" + Roff(text.footer) + "\n";
  if (!text.examples.empty()) out += ".PP\nExamples:\n" + Examples(text.examples);
  for (const CLI::App* each : command.get_subcommands({})) out += CommandSection(*each, name + " " + each->get_name());
  return out;
}

}  // namespace

std::string ManualPage(const CLI::App& root) {
  const CommandText text = Describe(root, root.get_name());
  std::string out =
      ".TH LENSCTL 1 \"\" \"lensd " LENSD_VERSION "\" \"lensd\"\n.SH NAME\nlensctl \\- " + Roff(text.about) +
      "\n.SH SYNOPSIS\n.B lensctl\n[OPTIONS] COMMAND ...\n.SH OPTIONS\nThey may stand before and after the command.\n";
  for (const Section& section : text.sections) {
    if (section.title.starts_with("Options")) out += Rows(section.rows);
  }
  out += ".SH QUANTITIES AND EXIT STATUS\n" + Roff(text.footer) + "\n.SH EXAMPLES\n" + Examples(text.examples) +
         ".SH COMMANDS\n";
  for (const CLI::App* each : root.get_subcommands({}))
    out += CommandSection(*each, root.get_name() + " " + each->get_name());
  return out + ".SH SEE ALSO\n.BR lensd (8),\n.BR systemd (1),\n.BR journalctl (1)\n";
}

}  // namespace lensd::cli
