// What every lensctl command shares: the global options, how a command ends, and where its answer goes.
#pragma once

#include <array>
#include <expected>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "base/clock.h"
#include "base/result.h"
#include "cli/terminal/exit_status.h"

namespace CLI {
class App;
}

namespace lensd::cli {

/// A command that could not do its work: one line for people (what, why, what to do), the status, and what else is
/// known for programs.
struct Failure {
  Exit status = Exit::Internal;
  std::string message;
  std::shared_ptr<const nlohmann::json> details = nullptr;  ///< an object: lens, axis, minimum, ...

  Failure(Exit ends_with, std::string line) : status(ends_with), message(std::move(line)) {}
  Failure(const Error& error);  // NOLINT: errors pass on
};

/// What a command returns: Exit::Done or Exit::No after printing its answer, or a Failure having printed nothing.
using Outcome = std::expected<Exit, Failure>;

/// `return Refuse(Exit::Usage, "…");` from a command.
[[nodiscard]] inline std::unexpected<Failure> Refuse(Exit status, std::string message) {
  return std::unexpected(Failure(status, std::move(message)));
}

/// The same where the command was reading an input file: Code::Io is Exit::NoInput.
template <class T>
[[nodiscard]] std::unexpected<Failure> RefuseInput(const Result<T>& failed) {
  Failure failure(failed.error());
  if (failed.error().code == Code::Io) failure.status = Exit::NoInput;
  return std::unexpected(std::move(failure));
}
/// The same where it was writing a file: Code::Io is Exit::CannotWrite.
template <class T>
[[nodiscard]] std::unexpected<Failure> RefuseOutput(const Result<T>& failed) {
  Failure failure(failed.error());
  if (failed.error().code == Code::Io) failure.status = Exit::CannotWrite;
  return std::unexpected(std::move(failure));
}

/// Where distances on the command line start.
enum class From { Lens, Sensor, Front };
/// Their names, in that order.
inline constexpr std::array<std::string_view, 3> kFromNames = {"lens", "sensor", "front"};

/// Options that work before and after the command.
struct Globals {
  bool json = false;                  ///< one line of JSON for programs instead of text for people
  std::optional<std::string> socket;  ///< --socket or --rig, else $LENSD_SOCKET; nothing: the built-in path
  std::optional<Duration> timeout;    ///< --timeout: for answers of the daemon
  std::optional<From> from;           ///< --from; empty: the lens's own `distance_from`, or the lens centre
};

/// One run of lensctl. Not thread-safe.
class Session {
 public:
  explicit Session(Globals globals) : globals_(std::move(globals)) {}

  const Globals& globals() const { return globals_; }
  bool json() const { return globals_.json; }

  /// Says why the command failed: one line on stderr for people, and with --json one line on stdout for programs.
  void Explain(const Failure& failure);
  /// Writes one line with one JSON value to stdout at once. Streams call it once per item, other commands once.
  void PrintJson(const nlohmann::json& value);
  /// Writes text for people to stdout; a newline is added where there is none.
  void PrintText(std::string_view text);
  /// Writes one remark for people to stderr (progress, warnings); allowed with --json too.
  void Remark(std::string_view line);

 private:
  Globals globals_;
};

/// The chosen command, bound to its options.
using Run = std::function<Outcome(Session&)>;
/// Adds one command to the parser; its callback sets `run`. Options with units are read as text and parsed when run.
using AddCommand = void (*)(CLI::App& root, Run& run);

/// Groups of `lensctl --help`.
inline constexpr const char* kOffline = "Optics, without the daemon";
inline constexpr const char* kOnline = "Lenses, through the daemon";
inline constexpr const char* kPlumbing = "Protocol";

}  // namespace lensd::cli
