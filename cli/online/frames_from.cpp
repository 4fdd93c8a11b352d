// autofocus --frames-from: a session whose frames a shell command takes.
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <span>

#include "cli/online/autofocus.h"
#include "cli/online/progress.h"
#include "cli/online/texts.h"
#include "cli/quantity.h"
#include "io/png.h"
#include "varlink/base64.h"

namespace lensd::cli {
namespace {

using varlink::Json;

constexpr std::size_t kPieceBytes = std::size_t{512} << 10;
constexpr Duration kPatience = std::chrono::minutes(61);  // longer than any session lasts

/// A place for one picture, named in the environment.
class Spot {
 public:
  Spot() {
    std::string made = (std::filesystem::temp_directory_path() / "lensctl-XXXXXX").string();
    if (mkdtemp(made.data()) != nullptr) folder_ = made;
    setenv("LENSD_FRAME", path().c_str(), 1);
  }
  ~Spot() {
    std::error_code ignored;
    if (!folder_.empty()) std::filesystem::remove_all(folder_, ignored);
  }
  Spot(const Spot&) = delete;
  Spot& operator=(const Spot&) = delete;
  bool usable() const { return !folder_.empty(); }
  std::string path() const { return folder_ + "/frame.png"; }

 private:
  std::string folder_;
};

/// Colours become luma (Rec. 709).
io::Image Grey(io::Image image) {
  if (image.channels == 1) return image;
  std::vector<std::uint16_t> grey;
  for (std::size_t i = 0; i + 2 < image.samples.size(); i += 3) {
    const double luma = 0.2126 * image.samples[i] + 0.7152 * image.samples[i + 1] + 0.0722 * image.samples[i + 2];
    grey.push_back(static_cast<std::uint16_t>(std::lround(luma)));
  }
  image.samples = std::move(grey);
  image.channels = 1;
  return image;
}

std::vector<std::uint8_t> BytesOf(const io::Image& image) {
  std::vector<std::uint8_t> bytes;
  for (const std::uint16_t sample : image.samples) {
    bytes.push_back(static_cast<std::uint8_t>(sample & 0xFF));
    if (image.bits == 16) bytes.push_back(static_cast<std::uint8_t>(sample >> 8));
  }
  return bytes;
}

/// Runs the command; the parameters of AutofocusFrame without its pixels, and the picture.
std::expected<std::pair<Json, io::Image>, Failure> Take(const std::string& command, const Spot& spot) {
  std::error_code ignored;
  std::filesystem::remove(spot.path(), ignored);
  const Instant start = MonotonicClock().Now();
  const int status = std::system(command.c_str());
  const Instant end = MonotonicClock().Now();
  if (status == -1 || !WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    return Refuse(Exit::Io, "--frames-from: the command failed, so there is no frame: " + command);
  }
  auto image = io::ReadPng(spot.path());
  if (!image)
    return Refuse(image.error().code == Code::Io ? Exit::NoInput : Exit::BadData,
                  "--frames-from: the command left no usable PNG in $LENSD_FRAME: " + image.error().message);
  io::Image grey = Grey(*std::move(image));
  // The exposure was somewhere in between.
  Json frame{{"widthPx", grey.width},
             {"heightPx", grey.height},
             {"format", grey.bits == 16 ? "mono16le" : "mono8"},
             {"exposureStartNs", start.time_since_epoch().count()},
             {"exposureEndNs", end.time_since_epoch().count()}};
  return std::pair(std::move(frame), std::move(grey));
}

std::expected<Json, Failure> Send(DaemonClient& link, const Json& session, Json frame,
                                  const std::vector<std::uint8_t>& bytes) {
  for (std::size_t offset = 0; offset < bytes.size(); offset += kPieceBytes) {
    const auto piece = std::span(bytes).subspan(offset, std::min(kPieceBytes, bytes.size() - offset));
    auto sent = link.Ask(MethodOfLens("AutofocusPixels"),
                         {{"session", session}, {"offset", offset}, {"data", varlink::EncodeBase64(piece)}}, kPatience);
    if (!sent) return sent;
  }
  frame["session"] = session;
  return link.Ask(MethodOfLens("AutofocusFrame"), std::move(frame), kPatience);
}

}  // namespace

std::expected<Json, Failure> FocusByCommand(Session& session, DaemonClient& link, Json parameters,
                                            const AutofocusOptions& options, Recording* recording) {
  if (!options.pixel.empty()) {
    auto pitch = ParseLength(options.pixel, "--pixel");
    if (!pitch) return PassOn(pitch);
    parameters["pixelUm"] = pitch->value * 1e6;
  }
  if (!parameters.contains("regions")) {
    parameters["regions"] = Json::array({{{"x", 0.4}, {"y", 0.4}, {"w", 0.2}, {"h", 0.2}}});
  }
  const Spot spot;
  if (!spot.usable()) return Refuse(Exit::CannotWrite, "--frames-from: no room for a picture in the temporary folder");
  ProgressLine line(session);
  auto reply = link.Ask(MethodOfLens("AutofocusBegin"), std::move(parameters), kPatience);
  if (!reply) return reply;
  const Json run = (*reply)["session"];
  while (reply->contains("next")) {
    line.Show(AutofocusStepText((*reply)["next"]));
    auto taken = Take(options.frames_from, spot);
    if (!taken) return PassOn(taken);
    auto& [frame, picture] = *taken;
    if (options.gamma) frame["gamma"] = *options.gamma;
    if (recording != nullptr) {
      auto saved = recording->Save(picture, {.exposure_start_ns = frame["exposureStartNs"].get<std::int64_t>(),
                                             .bits = picture.bits,
                                             .gamma = options.gamma.value_or(1.0),
                                             .extension_mm = (*reply)["next"].value("extensionMm", Json())});
      if (!saved) return RefuseOutput(saved);
    }
    reply = Send(link, run, std::move(frame), BytesOf(picture));
    if (!reply) return reply;
  }
  return (*reply)["autofocus"];
}

}  // namespace lensd::cli
