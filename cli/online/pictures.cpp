// autofocus, snapshot.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "cli/online/arguments.h"
#include "cli/online/commands.h"
#include "cli/online/link.h"
#include "cli/online/pictures.h"
#include "cli/online/texts.h"
#include "cli/quantity.h"
#include "io/png.h"
#include "proto/base64.h"

namespace lensd::cli {
namespace {

using proto::Json;

struct AutofocusOptions {
  std::string name;
  std::string region;
  std::string method;
};

/// `X,Y,W,H` as fractions of the frame.
Result<Json> ParseRegion(std::string_view text) {
  constexpr const char* kKeys[] = {"x", "y", "w", "h"};
  Json region = Json::object();
  for (std::size_t i = 0; i < std::size(kKeys); ++i) {
    const std::size_t comma = text.find(',');
    if ((comma == text.npos) != (i + 1 == std::size(kKeys))) {
      return Fail(Code::InvalidArgument, "--roi: say X,Y,W,H as fractions of the frame, such as 0.4,0.4,0.2,0.2");
    }
    auto number = ParseNumber(text.substr(0, comma), "--roi");
    if (!number) return PassOn(std::move(number));
    region[kKeys[i]] = *number->Nearest();
    text.remove_prefix(comma == text.npos ? text.size() : comma + 1);
  }
  return region;
}

/// One line that rewrites itself, on a terminal only.
class ProgressLine {
 public:
  void Show(const Json& progress) {
    if (!on_terminal_) return;
    const std::string text = "frame " + NumberText(progress, "frames", 6, "") + " of about " +
                             NumberText(progress, "framesExpected", 6, "") + ", position " +
                             NumberText(progress, "position", 8, "");
    std::fprintf(stderr, "\r%-60s", text.c_str());
    shown_ = true;
  }
  ~ProgressLine() {
    if (shown_) std::fprintf(stderr, "\r%-60s\r", "");
  }

 private:
  bool on_terminal_ = isatty(STDERR_FILENO) == 1;
  bool shown_ = false;
};

Outcome Autofocus(Session& session, const AutofocusOptions& options) {
  Json parameters{{"lens", LensOf(options.name)}};
  if (!options.method.empty()) parameters["method"] = options.method;
  if (!options.region.empty()) {
    auto region = ParseRegion(options.region);
    if (!region) return Refuse(region);
    parameters["region"] = *std::move(region);
  }
  auto link = Link::Open(session);
  if (!link) return std::unexpected(link.error());
  // Control-C needs no stop of its own: closing the connection ends an autofocus.
  auto reply = [&] {
    ProgressLine line;
    return link->Follow(MethodOfLens("Autofocus"), std::move(parameters), [&](const Json& step) {
      if (step.contains("progress") && step["progress"].is_object()) line.Show(step["progress"]);
      return true;
    });
  }();
  if (!reply) return std::unexpected(reply.error());
  const Json& result = (*reply)["autofocus"];
  session.json() ? session.PrintJson(result) : session.PrintText(AutofocusText(result));
  return result.value("focused", false) ? Exit::Done : Exit::No;
}

Outcome Snapshot(Session& session, const std::string& name, const std::string& path) {
  auto link = Link::Open(session);
  if (!link) return std::unexpected(link.error());
  const auto frame = SaveSnapshot(*link, LensOf(name), path);
  if (!frame) return std::unexpected(frame.error());
  if (session.json()) {
    session.PrintJson(*frame);
  } else {
    session.PrintText(path + ": " + NumberText(*frame, "widthPx", 6, "x") + NumberText(*frame, "heightPx", 6, " px, ") +
                      "f/" + NumberText(*frame, "fNumber", 4, ""));
  }
  return Exit::Done;
}

}  // namespace

std::expected<Json, Failure> SaveSnapshot(Link& link, const Json& lens, const std::string& path) {
  std::vector<std::uint8_t> png;
  Json frame = Json::object();
  std::optional<Error> wrong;
  const auto take = [&](const Json& piece) {
    if (piece.contains("frame") && piece["frame"].is_object()) frame = piece["frame"];
    auto bytes = proto::DecodeBase64(piece.value("png", ""));
    if (bytes && piece.value("offset", std::size_t{0}) != png.size())
      bytes = Fail(Code::Protocol, "a piece is missing");
    if (!bytes) wrong = bytes.error();
    if (bytes) png.insert(png.end(), bytes->begin(), bytes->end());
    return !wrong;
  };
  auto last = link.Follow(MethodOfLens("Snapshot"), {{"lens", lens}}, take);
  if (!last) return std::unexpected(last.error());
  if (!wrong) take(*last);
  if (wrong) return std::unexpected(Failure(*wrong));
  if (auto written = io::WriteFileAtomically(path, png.data(), png.size()); !written) return Refuse(written);
  frame["file"] = path;
  return frame;
}

void AddAutofocus(CLI::App& root, Run& run) {
  auto options = std::make_shared<AutofocusOptions>();
  auto* command = root.add_subcommand("autofocus", "focus on a region of the picture, or refuse and go back");
  command->group(kOnline);
  command->add_option("NAME", options->name, "lens");
  command->add_option("--roi", options->region, "region as fractions of the frame")->type_name("X,Y,W,H");
  command->add_option("--method", options->method, "method; the daemon chooses when left out")->type_name("NAME");
  command->callback([&run, options] { run = [options](Session& session) { return Autofocus(session, *options); }; });
}

void AddSnapshot(CLI::App& root, Run& run) {
  struct Options {
    std::string name;
    std::string path;
  };
  auto options = std::make_shared<Options>();
  auto* command = root.add_subcommand("snapshot", "save one new frame as PNG")->group(kOnline);
  command->add_option("NAME", options->name, "lens");
  command->add_option("-o", options->path, "where to save it")->required()->type_name("FILE.png");
  command->callback([&run, options] {
    run = [options](Session& session) { return Snapshot(session, options->name, options->path); };
  });
}

}  // namespace lensd::cli
