// log: the journal's lines about a lens. journalctl knows how to read them; which are of a lens lensd has marked.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstring>
#include <memory>

#include "cli/online/commands.h"

namespace lensd::cli {
namespace {

struct LogText {
  std::string name;
  int lines = 50;
  bool follow = false;
};

Outcome Log(Session& session, const LogText& text) {
  std::vector<std::string> words = {"journalctl",
                                    "--no-pager",
                                    "--output",
                                    session.json() ? "json" : "short-iso",
                                    "--lines",
                                    std::to_string(text.lines),
                                    "SYSLOG_IDENTIFIER=lensd"};
  if (text.follow) words.emplace_back("--follow");
  if (!text.name.empty()) words.push_back("LENS=" + text.name);
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  execvp(arguments[0], arguments.data());
  return Refuse(Exit::Unavailable, std::string("journalctl cannot be run: ") + std::strerror(errno) +
                                       "; lensd logs to the journal, or to stderr where it is run by hand");
}

}  // namespace

void AddLog(CLI::App& root, Run& run) {
  auto text = std::make_shared<LogText>();
  auto* command = root.add_subcommand("log", "show the log of lensd, about one lens or all")->group(kOnline);
  command->add_option("NAME", text->name, "lens; all of them when left out");
  command->add_option("-n,--lines", text->lines, "number of lines, the newest ones")
      ->check(CLI::Range(0, 1000000))
      ->capture_default_str();
  command->add_flag("-f,--follow", text->follow, "show new lines until Control-C");
  command->callback([&run, text] { run = [text](Session& session) { return Log(session, *text); }; });
}

}  // namespace lensd::cli
