// snapshot: one frame, all of it or a part, in a file or on stdout.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <limits>
#include <memory>

#include "cli/link/arguments.h"
#include "cli/link/daemon_client.h"
#include "cli/online/commands.h"
#include "cli/online/pictures/pictures.h"
#include "cli/text/texts.h"
#include "io/picture_notes.h"
#include "io/png.h"
#include "varlink/base64.h"

namespace lensd::cli {
namespace {

using varlink::Json;

constexpr const char* kStdout = "-";

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

/// Of a file's name, in small letters: cameras write IMG_1.JPG.
std::string EndingOf(const std::string& path) {
  std::string ending = std::filesystem::path(path).extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char letter) { return std::tolower(letter); });
  return ending;
}

/// As the file's ending says, where nothing else does.
std::string EncodingOf(const SnapshotOptions& options) {
  if (!options.encoding.empty()) return options.encoding;
  const std::string ending = EndingOf(options.path);
  return ending == ".jpg" || ending == ".jpeg" ? "jpeg" : "png";
}

/// A user who writes frame.gif wants no PNG under that name.
std::optional<Failure> WrongEnding(const SnapshotOptions& options) {
  const std::string ending = EndingOf(options.path);
  if (!options.encoding.empty() || ending.empty() || ending == ".png" || ending == ".jpg" || ending == ".jpeg") {
    return std::nullopt;
  }
  return Failure(Exit::Usage,
                 "-o '" + options.path +
                     "': a picture is PNG or JPEG by its name's ending, .png, .jpg or .jpeg; of another name "
                     "say which, as in --encoding png");
}

/// On stdout the picture has to be alone, and somewhere that takes bytes.
std::optional<Failure> WrongStdout(const Session& session, const SnapshotOptions& options) {
  if (options.path != kStdout) return std::nullopt;
  if (session.json()) {
    return Failure(Exit::Usage, "-o -: the picture goes to stdout, which --json needs too; name a file");
  }
  if (isatty(STDOUT_FILENO) != 0) {
    return Failure(Exit::Usage, "-o -: stdout is a terminal; send the picture on, as in | display, or name a file");
  }
  return std::nullopt;
}

std::expected<Json, Failure> ParametersOf(const SnapshotOptions& options) {
  if (auto wrong = WrongEnding(options)) return std::unexpected(*std::move(wrong));
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
  if (auto wrong = WrongStdout(session, options)) return std::unexpected(*std::move(wrong));
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
  const std::string text = options.path + ": " + TextOf(picture, "encoding") + ", " +
                           NumberText(picture, "widthPx", 6, "x") + NumberText(picture, "heightPx", 6, " px of ") +
                           NumberText(picture, "bits", 2, " bits, ") +
                           (picture.value("channels", 1) == 3 ? "colour" : "grey") + ", f/" +
                           NumberText(*frame, "fNumber", 4, "") + (frame->value("moving", false) ? ", in motion" : "");
  options.path == kStdout ? session.Remark(text) : session.PrintText(text);
  return Exit::Done;
}

std::optional<double> NumberAt(const Json& object, const char* key, double scale = 1.0) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number() ? std::optional(found->get<double>() * scale) : std::nullopt;
}

/// The local time at which this exposure began, as EXIF writes it; empty where the camera does not tell.
std::string TakenAt(const Json& frame) {
  const auto start = frame.find("exposureStartNs");
  if (start == frame.end() || !start->is_number()) return "";
  const auto ago = MonotonicClock().Now().time_since_epoch() - std::chrono::nanoseconds(start->get<std::int64_t>());
  const std::time_t taken = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now() -
                                                                 std::chrono::floor<std::chrono::microseconds>(ago));
  std::tm local{};
  localtime_r(&taken, &local);
  std::array<char, 32> text{};
  return {text.data(), std::strftime(text.data(), text.size(), "%Y:%m:%d %H:%M:%S", &local)};
}

/// The plane in focus during the exposure, by the thin lens from the focal length and extension of that time.
std::optional<double> VergenceOf(const Json& frame, const Json& status) {
  const auto f = NumberAt(status, "focalLengthMm", 1e-3), extension = NumberAt(frame, "extensionMm", 1e-3);
  if (!f || !extension) return std::nullopt;
  return *extension / (*f * (*f + *extension));
}

/// `status` is the lens just after the frame.
io::PictureNotes NotesOf(const Json& frame, const Json& status) {
  const auto vergence = VergenceOf(frame, status);
  io::PictureNotes notes{.software = "lensctl " LENSD_VERSION,
                         .taken = TakenAt(frame),
                         .lens = TextOf(status, "name"),
                         .exposure_s = NumberAt(frame, "exposureMs", 1e-3),
                         .f_number = NumberAt(frame, "fNumber"),
                         .distance_m = std::nullopt,
                         .focal_length_mm = NumberAt(status, "focalLengthMm"),
                         .own = {}};
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (vergence && *vergence >= 0.0) notes.distance_m = *vergence > 0.0 ? 1.0 / *vergence : kInfinity;
  const auto tell = [&notes](const char* name, const Json& object, const char* key) {
    const auto found = object.find(key);
    if (found == object.end() || found->is_null()) return;
    notes.own.emplace_back(name, found->is_string() ? found->get<std::string>() : varlink::WriteJson(*found));
  };
  const Json focused{{"vergenceD", vergence ? Json(*vergence) : Json()}};
  tell("Lens", status, "name");
  tell("VergenceD", focused, "vergenceD");
  for (const auto& [name, key] :
       {std::pair("ExtensionMm", "extensionMm"), std::pair("ExtensionBoundUm", "extensionBoundUm"),
        std::pair("FNumber", "fNumber"), std::pair("FNumberBound", "fNumberBound"), std::pair("Moving", "moving")}) {
    tell(name, frame, key);
  }
  tell("FocalLengthMm", status, "focalLengthMm");
  tell("Grade", status, "grade");
  tell("TemperatureC", status, "temperatureC");
  for (const Json& axis : frame.value("axes", Json::array())) {
    std::string name = TextOf(axis, "axis") + "Position";
    name[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(name[0])));
    tell(name.c_str(), axis, "position");
  }
  return notes;
}

/// What only eyes and programs of pictures look at is left out where it cannot be had: the picture itself is there.
void AddLensState(DaemonClient& link, const Json& lens, const Json& frame, std::vector<std::uint8_t>& file) {
  const std::string encoding = TextOf(frame["picture"], "encoding");
  if (encoding != "png" && encoding != "jpeg") return;
  const auto reply = link.Ask(MethodOfLens("Status"), {{"lens", lens}});
  if (!reply || (*reply)["lenses"].size() != 1) return;
  [[maybe_unused]] const auto added = io::AddNotes(file, NotesOf(frame, (*reply)["lenses"][0]));
}

Result<void> WriteToStdout(const std::vector<std::uint8_t>& bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t wrote = write(STDOUT_FILENO, bytes.data() + done, bytes.size() - done);
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) return Fail(Code::Io, std::string("stdout: ") + std::strerror(errno));
    done += static_cast<std::size_t>(wrote);
  }
  return {};
}

}  // namespace

std::expected<TakenPicture, Failure> TakeSnapshot(DaemonClient& link, Json parameters) {
  TakenPicture taken{.frame = Json::object(), .bytes = {}};
  auto& [frame, bytes] = taken;
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
  return taken;
}

std::expected<Json, Failure> SaveSnapshot(DaemonClient& link, Json parameters, const std::string& path) {
  const Json lens = parameters.value("lens", Json());
  auto taken = TakeSnapshot(link, std::move(parameters));
  if (!taken) return PassOn(taken);
  auto& [frame, bytes] = *taken;
  AddLensState(link, lens, frame, bytes);
  const Result<void> written =
      path == kStdout ? WriteToStdout(bytes) : io::WriteFileAtomically(path, bytes.data(), bytes.size());
  if (!written) return RefuseOutput(written);
  frame["file"] = path;
  return frame;
}

void AddSnapshot(CLI::App& root, Run& run) {
  auto options = std::make_shared<SnapshotOptions>();
  auto* command = root.add_subcommand("snapshot", "save one new frame of a lens' camera")->group(kOnline);
  command->add_option("NAME", options->name, "lens");
  command->add_option("-o", options->path, "where to save it; - is stdout")->required()->type_name("FILE");
  command
      ->add_option("--encoding", options->encoding,
                   "png, jpeg (for viewing), raw (unchanged samples), gray8 or rgb8 (a byte each); when left out, jpeg "
                   "for .jpg and .jpeg, else png")
      ->check(CLI::IsMember({"png", "jpeg", "raw", "gray8", "rgb8"}));
  command->add_option("--region", options->region, "part of the frame, as fractions of it from the upper left corner")
      ->type_name("X,Y,W,H");
  command->add_option("--scale-to", options->size, "reduce the picture to fit into this many pixels")->type_name("WxH");
  command->add_flag("--in-motion", options->in_motion,
                    "take the frame at once, even if the lens moves, instead of waiting until it rests");
  command->callback([&run, options] { run = [options](Session& session) { return Snapshot(session, *options); }; });
}

}  // namespace lensd::cli
