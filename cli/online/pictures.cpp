// snapshot: one frame, all of it or a part, in a file.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
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

struct SnapshotOptions {
  std::string name;
  std::string path;
  std::string region;
  std::string size;
  std::string encoding;
  bool in_motion = false;
};

/// "WxH" in pixels.
Result<Json> ParseSize(const std::string& text) {
  const std::size_t cross = text.find('x');
  int width = 0, height = 0;
  const char* const middle = text.data() + std::min(cross, text.size());
  const char* const end = text.data() + text.size();
  const bool good = cross != text.npos && std::from_chars(text.data(), middle, width).ptr == middle &&
                    std::from_chars(middle + 1, end, height).ptr == end && width >= 1 && height >= 1;
  if (!good) return Fail(Code::InvalidArgument, "--scale-to: say WIDTHxHEIGHT in pixels, such as 640x480");
  return Json{{"widthPx", width}, {"heightPx", height}};
}

/// As the file's ending says, where nothing else does.
std::string EncodingOf(const SnapshotOptions& options) {
  if (!options.encoding.empty()) return options.encoding;
  return options.path.ends_with(".jpg") || options.path.ends_with(".jpeg") ? "jpeg" : "png";
}

std::expected<Json, Failure> ParametersOf(const SnapshotOptions& options) {
  Json parameters{{"lens", LensOf(options.name)}, {"encoding", EncodingOf(options)}};
  if (options.in_motion) parameters["inMotion"] = true;
  if (!options.region.empty()) {
    auto region = ParseRegion(options.region, "--region");
    if (!region) return PassOn(region);
    parameters["region"] = *std::move(region);
  }
  if (!options.size.empty()) {
    auto size = ParseSize(options.size);
    if (!size) return PassOn(size);
    parameters["scaleTo"] = *std::move(size);
  }
  return parameters;
}

Outcome Snapshot(Session& session, const SnapshotOptions& options) {
  auto parameters = ParametersOf(options);
  if (!parameters) return PassOn(parameters);
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  const auto frame = SaveSnapshot(*link, *std::move(parameters), options.path);
  if (!frame) return PassOn(frame);
  if (session.json()) {
    session.PrintJson(*frame);
    return Exit::Done;
  }
  const Json& picture = (*frame)["picture"];
  session.PrintText(options.path + ": " + TextOf(picture, "encoding") + ", " + NumberText(picture, "widthPx", 6, "x") +
                    NumberText(picture, "heightPx", 6, " px of ") + NumberText(picture, "bits", 2, " bits, ") +
                    (picture.value("channels", 1) == 3 ? "colour" : "grey") + ", f/" +
                    NumberText(*frame, "fNumber", 4, "") + (frame->value("moving", false) ? ", in motion" : ""));
  return Exit::Done;
}

}  // namespace

std::expected<Json, Failure> SaveSnapshot(DaemonClient& link, Json parameters, const std::string& path) {
  std::vector<std::uint8_t> bytes;
  Json frame = Json::object();
  std::optional<Error> wrong;
  const auto take = [&](const Json& piece) {
    if (piece.contains("frame") && piece["frame"].is_object()) {
      frame = piece["frame"];
      frame["picture"] = piece.value("picture", Json::object());
    }
    auto part = varlink::DecodeBase64(piece.value("data", ""));
    if (part && piece.value("offset", std::size_t{0}) != bytes.size())
      part = Fail(Code::Protocol, "a piece is missing");
    if (!part) wrong = part.error();
    if (part) bytes.insert(bytes.end(), part->begin(), part->end());
    return !wrong;
  };
  auto last = link.Follow(MethodOfLens("Snapshot"), std::move(parameters), take);
  if (!last) return PassOn(last);
  if (!wrong) take(*last);
  if (wrong) return std::unexpected(Failure(*wrong));
  if (auto written = io::WriteFileAtomically(path, bytes.data(), bytes.size()); !written) return RefuseOutput(written);
  frame["file"] = path;
  return frame;
}

void AddSnapshot(CLI::App& root, Run& run) {
  auto options = std::make_shared<SnapshotOptions>();
  auto* command = root.add_subcommand("snapshot", "save one new frame of a lens' camera")->group(kOnline);
  command->add_option("NAME", options->name, "lens");
  command->add_option("-o", options->path, "where to save it")->required()->type_name("FILE");
  command
      ->add_option(
          "--encoding", options->encoding,
          "png, jpeg (for eyes), raw (samples as they are), gray8 or rgb8 (a byte each); by FILE's ending when "
          "left out: jpeg for .jpg and .jpeg, else png")
      ->check(CLI::IsMember({"png", "jpeg", "raw", "gray8", "rgb8"}));
  command->add_option("--region", options->region, "part of the frame, as fractions of it from the upper left corner")
      ->type_name("X,Y,W,H");
  command->add_option("--scale-to", options->size, "make it smaller, to fit into this many pixels")->type_name("WxH");
  command->add_flag("--in-motion", options->in_motion,
                    "right away, though the lens may move; else once it has come to rest");
  command->callback([&run, options] { run = [options](Session& session) { return Snapshot(session, *options); }; });
}

}  // namespace lensd::cli
