// snapshot.
#include <CLI/CLI.hpp>
#include <memory>

#include "cli/online/arguments.h"
#include "cli/online/commands.h"
#include "cli/online/daemon_client.h"
#include "cli/online/pictures.h"
#include "cli/online/texts.h"
#include "io/png.h"
#include "varlink/base64.h"

namespace lensd::cli {
namespace {

using varlink::Json;

Outcome Snapshot(Session& session, const std::string& name, const std::string& path) {
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  const auto frame = SaveSnapshot(*link, LensOf(name), path);
  if (!frame) return PassOn(frame);
  if (session.json()) {
    session.PrintJson(*frame);
  } else {
    session.PrintText(path + ": " + NumberText(*frame, "widthPx", 6, "x") + NumberText(*frame, "heightPx", 6, " px, ") +
                      "f/" + NumberText(*frame, "fNumber", 4, ""));
  }
  return Exit::Done;
}

}  // namespace

std::expected<Json, Failure> SaveSnapshot(DaemonClient& link, const Json& lens, const std::string& path) {
  std::vector<std::uint8_t> png;
  Json frame = Json::object();
  std::optional<Error> wrong;
  const auto take = [&](const Json& piece) {
    if (piece.contains("frame") && piece["frame"].is_object()) frame = piece["frame"];
    auto bytes = varlink::DecodeBase64(piece.value("png", ""));
    if (bytes && piece.value("offset", std::size_t{0}) != png.size())
      bytes = Fail(Code::Protocol, "a piece is missing");
    if (!bytes) wrong = bytes.error();
    if (bytes) png.insert(png.end(), bytes->begin(), bytes->end());
    return !wrong;
  };
  auto last = link.Follow(MethodOfLens("Snapshot"), {{"lens", lens}}, take);
  if (!last) return PassOn(last);
  if (!wrong) take(*last);
  if (wrong) return std::unexpected(Failure(*wrong));
  if (auto written = io::WriteFileAtomically(path, png.data(), png.size()); !written) return RefuseOutput(written);
  frame["file"] = path;
  return frame;
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
