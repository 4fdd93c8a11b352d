// lensctl: reads the command line, runs one command, and turns how it ended into an exit status.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cli/commands.h"
#include "cli/help/completion.h"
#include "cli/help/help.h"
#include "cli/terminal/session.h"
#include "cli/text/quantity.h"
#include "cli/text/text.h"
#include "proto/interfaces.h"

namespace lensd::cli {
namespace {

/// The global options as written.
struct GlobalText {
  bool json = false;
  std::string socket;
  std::string rig;
  std::string timeout;
  std::string from;
  std::string units;
};

void AddGlobals(CLI::App& root, GlobalText& text) {
  root.add_flag("--json", text.json, "one line of JSON on stdout, for programs")->group("Global");
  root.add_option("--socket", text.socket, "the daemon's socket (default $LENSD_SOCKET, else /run/lensd/io.lensd.Lens)")
      ->type_name("PATH")
      ->group("Global");
  root.add_option("--rig", text.rig, "the daemon of this name, if several run (lensd@NAME.service)")
      ->type_name("NAME")
      ->group("Global");
  root.add_option("--timeout", text.timeout, "longest wait for an answer of the daemon, such as 500ms or 30s")
      ->type_name("TIME")
      ->group("Global");
  root.add_option("--from", text.from, "where distances start: lens (its centre), sensor or front")
      ->type_name("ORIGIN")
      ->group("Global");
  root.add_option("--units", text.units, "distances in text as m, mm, ft, in or D (default: as the first one typed)")
      ->type_name("UNIT")
      ->group("Global");
}

/// Nothing: the built-in one.
Result<std::optional<std::string>> SocketOf(const GlobalText& text) {
  if (!text.rig.empty() && !text.socket.empty()) {
    return Fail(Code::InvalidArgument, "--rig and --socket both say which daemon; give one of them");
  }
  if (!text.socket.empty()) return text.socket;
  if (!text.rig.empty()) {
    const auto plain = [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
    };
    if (std::ranges::all_of(text.rig, plain)) return proto::RigSocket(text.rig);
    return Fail(Code::InvalidArgument, "--rig '" + text.rig + "': a name has letters, digits, - and _");
  }
  const char* const variable = std::getenv("LENSD_SOCKET");
  if (variable != nullptr && *variable != 0) return variable;
  return std::nullopt;
}

Result<Globals> ParseGlobals(const GlobalText& text) {
  Globals globals;
  globals.json = text.json;
  auto socket = SocketOf(text);
  if (!socket) return PassOn(socket);
  globals.socket = *std::move(socket);
  if (!text.timeout.empty()) {
    auto timeout = ParseTime(text.timeout, "--timeout");
    if (!timeout) return PassOn(timeout);
    globals.timeout = *timeout;
  }
  if (!text.from.empty()) {
    const auto* found = std::ranges::find(kFromNames, text.from);
    if (found == kFromNames.end()) {
      return Fail(Code::InvalidArgument, "--from '" + text.from + "': say lens, sensor or front");
    }
    globals.from = static_cast<From>(found - kFromNames.begin());
  }
  return globals;
}

Result<DistanceUnit> ParseUnits(const GlobalText& text, std::span<const char* const> arguments) {
  if (text.units.empty()) return UnitOfFirstDistance(arguments);
  const auto* found = std::ranges::find(kDistanceUnits, text.units);
  if (found != kDistanceUnits.end()) return static_cast<DistanceUnit>(found - kDistanceUnits.begin());
  return Fail(Code::InvalidArgument, "--units '" + text.units + "': say m, mm, ft, in or D");
}

int End(Session& session, const Failure& failure) {
  session.Explain(failure);
  return static_cast<int>(failure.status);
}

/// The same before the global options make sense.
int EndEarly(const GlobalText& text, const Failure& failure) {
  Globals globals;
  globals.json = text.json;
  Session session(std::move(globals));
  return End(session, failure);
}

/// An option that is given with nothing in it: more likely a script's variable that is not set than a wish.
std::optional<Failure> EmptyOption(const CLI::App& command) {
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_positional() || option->count() == 0 || option->get_expected_max() == 0) continue;
    if (std::ranges::find(option->results(), "") == option->results().end()) continue;
    return Failure(Exit::Usage, option->get_name() + " is empty; leave it out or give it a value");
  }
  for (const CLI::App* chosen : command.get_subcommands()) {
    if (auto empty = EmptyOption(*chosen)) return empty;
  }
  return std::nullopt;
}

/// The parser may stop before it comes to --json, or take it for the value of an option that has none.
bool AsksForJson(int argc, char** argv) {
  return std::any_of(argv, argv + argc, [](const char* word) { return std::string_view(word) == "--json"; });
}

/// `completion words ...`: what follows is not to be parsed, for it is not written to its end.
bool AsksForWords(std::span<const char* const> arguments) {
  return std::string_view(arguments[0]) == "completion" && std::string_view(arguments[1]) == "words";
}

int OfferWords(const CLI::App& root, std::span<const char* const> arguments) {
  const std::vector<std::string> words(arguments.begin(), arguments.end());
  for (const std::string& offered : Completions(root, words)) std::printf("%s\n", offered.c_str());
  return 0;
}

int Main(int argc, char** argv) {
  CLI::App root("plan lens settings exactly, and drive lenses through lensd", "lensctl");
  root.set_version_flag("--version", "lensctl " LENSD_VERSION, "print it and end");
  root.set_help_flag("-h,--help", "this text; lensctl COMMAND --help for one command");
  root.fallthrough();
  root.require_subcommand(1);
  root.formatter_fn(
      [](const CLI::App* command, const std::string& name, CLI::AppFormatMode) { return HelpText(*command, name); });
  root.footer(
      "Quantities carry their unit: 0.8m 850mm 33in 5ft7in 2.5D inf 8um 1.5px 550nm\n"
      "3ms 25C 2%. F-numbers: 2.8 or f/2.8. Ranges: A..B. Exit status: 0 done, 1 the\n"
      "answer is no, 2 to 9 the lens or daemon refused, 64 and above as in sysexits.h;\n"
      "with --json the reason is {\"error\": CODE, \"message\": TEXT} on stdout.");
  const std::span<const char* const> arguments(argv + 1, static_cast<std::size_t>(std::max(argc - 1, 0)));
  GlobalText text;
  AddGlobals(root, text);
  Run run;
  for (const AddCommand add : kCommands) add(root, run);
  if (arguments.size() >= 3 && AsksForWords(arguments)) return OfferWords(root, arguments.subspan(2));
  const bool json = AsksForJson(argc, argv);
  try {
    root.parse(argc, argv);
    text.json |= json;
  } catch (const CLI::Success& asked) {
    if (NamesNoCommand(root)) return EndEarly(text, UsageFailure(root, asked));
    return root.exit(asked);
  } catch (const CLI::ParseError& error) {
    text.json |= json;
    return EndEarly(text, UsageFailure(root, error));
  }
  if (auto empty = EmptyOption(root)) return EndEarly(text, *empty);
  auto globals = ParseGlobals(text);
  const auto units = ParseUnits(text, arguments);
  if (!globals || !units) return EndEarly(text, globals ? units.error() : globals.error());
  ShowDistancesIn(*units);
  if (globals->from.value_or(From::Lens) != From::Lens) SayWhereDistancesStart();
  Session session(*std::move(globals));
  const Outcome outcome = run(session);
  if (!outcome) return End(session, outcome.error());
  if (std::ferror(stdout)) return End(session, {Exit::CannotWrite, "cannot write to stdout"});
  return static_cast<int>(*outcome);
}

/// An exception that no command foresaw ends like every other failure.
int EndThrown(int argc, char** argv, const std::string& message) {
  GlobalText text;
  text.json = AsksForJson(argc, argv);
  return EndEarly(text, {Exit::Internal, message});
}

}  // namespace
}  // namespace lensd::cli

int main(int argc, char** argv) {
  try {
    return lensd::cli::Main(argc, argv);
  } catch (const std::bad_alloc&) {
    return lensd::cli::EndThrown(argc, argv, "there is not enough memory for this");
  } catch (const std::exception& failure) {
    return lensd::cli::EndThrown(argc, argv, std::string("internal error: ") + failure.what());
  }
}
