// autofocus --frames-from: a session whose frames a shell command takes.
#include <spawn.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <span>

#include "cli/link/drive.h"
#include "cli/link/progress.h"
#include "cli/online/autofocus/autofocus.h"
#include "cli/text/quantity.h"
#include "cli/text/texts.h"
#include "io/png.h"
#include "varlink/base64.h"

namespace lensd::cli {
namespace {

using varlink::Json;

constexpr std::size_t kPieceBytes = std::size_t{512} << 10;

volatile std::sig_atomic_t caught_signal = 0;

/// Control-C and SIGTERM between two calls of the daemon: they are noted, so that the lens can be stopped and told of.
class SignalNotes {
 public:
  SignalNotes() {
    caught_signal = 0;
    struct sigaction note{};
    note.sa_handler = [](int signal) { caught_signal = signal; };
    for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &note, &before_[i]);
  }
  ~SignalNotes() {
    for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &before_[i], nullptr);
  }
  SignalNotes(const SignalNotes&) = delete;
  SignalNotes& operator=(const SignalNotes&) = delete;

 private:
  static constexpr std::array kSignals{SIGINT, SIGTERM};
  std::array<struct sigaction, kSignals.size()> before_{};
};

/// Whether the shell ran it and it succeeded. A signal that is caught meanwhile goes to it too.
bool RunInShell(const std::string& command) {
  std::string words[] = {"sh", "-c", command};
  char* const arguments[] = {words[0].data(), words[1].data(), words[2].data(), nullptr};
  pid_t child = 0;
  if (posix_spawn(&child, "/bin/sh", nullptr, nullptr, arguments, environ) != 0) return false;
  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) return false;
    kill(child, caught_signal);
  }
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

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
  const bool done = RunInShell(command);
  const Instant end = MonotonicClock().Now();
  if (caught_signal != 0) return Refuse(Exit::Interrupted, "interrupted");
  if (!done) {
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

/// Where each region was sharpest so far, of AutofocusStep.
std::string SharpestText(const Json& step) {
  std::vector<const Json*> best;
  for (const Json& sample : step["samples"]) {
    const auto same = std::ranges::find_if(best, [&](const Json* b) { return (*b)["region"] == sample["region"]; });
    if (same == best.end()) {
      best.push_back(&sample);
    } else if (sample["score"].get<double>() > (**same)["score"].get<double>()) {
      *same = &sample;
    }
  }
  if (best.empty()) return "no frame was judged yet";
  std::string text = "not focused; sharpest so far";
  for (const Json* sample : best) {
    text += sample == best.front() ? " " : ", ";
    if (best.size() > 1) text += "region " + NumberText(*sample, "region", 4, " ");
    text += "at position " + NumberText(*sample, "position", 8, " (frame ") + NumberText(*sample, "frame", 6, " of ") +
            std::to_string(step["frame"].get<int>() - 1) + ")";
  }
  return text;
}

/// One session: its calls, and what is told where it ends early.
class FramesSession {
 public:
  FramesSession(Session& session, DaemonClient& link, Json lens)
      : session_(session), link_(link), lens_(std::move(lens)), line_(session) {}

  std::expected<Json, Failure> Call(std::string_view method, Json parameters) {
    if (caught_signal != 0) return EndEarly(Failure(Exit::Interrupted, "interrupted"));
    auto reply = link_.Follow(MethodOfLens(method), std::move(parameters), nullptr, [this] { Tell(); });
    if (reply && reply->contains("next")) {
      next_ = (*reply)["next"];
      line_.Show(AutofocusStepText(next_));
    }
    return reply;
  }
  /// The frame that was wanted, and its pixels before it in pieces.
  std::expected<Json, Failure> Send(const Json& run, Json frame, const std::vector<std::uint8_t>& bytes) {
    for (std::size_t offset = 0; offset < bytes.size(); offset += kPieceBytes) {
      const auto piece = std::span(bytes).subspan(offset, std::min(kPieceBytes, bytes.size() - offset));
      auto sent =
          Call("AutofocusPixels", {{"session", run}, {"offset", offset}, {"data", varlink::EncodeBase64(piece)}});
      if (!sent) return sent;
    }
    frame["session"] = run;
    return Call("AutofocusFrame", std::move(frame));
  }
  /// There will be no further frame: the lens stays, and what is known is told.
  std::unexpected<Failure> EndEarly(Failure why) {
    Tell();
    return std::unexpected(std::move(why));
  }

 private:
  void Tell() {
    line_.Clear();
    StopAndTell(session_, lens_, "focus");
    session_.Remark(next_.is_object() ? SharpestText(next_) : "no frame was asked for yet");
  }

  Session& session_;
  DaemonClient& link_;
  const Json lens_;
  ProgressLine line_;
  Json next_;  ///< the newest AutofocusStep, or null
};

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
  const SignalNotes signals;
  FramesSession frames(session, link, parameters["lens"]);
  auto reply = frames.Call("AutofocusBegin", std::move(parameters));
  if (!reply) return reply;
  const Json run = (*reply)["session"];
  while (reply->contains("next")) {
    auto taken = Take(options.frames_from, spot);
    if (!taken) return frames.EndEarly(std::move(taken.error()));
    auto& [frame, picture] = *taken;
    if (options.gamma) frame["gamma"] = *options.gamma;
    if (recording != nullptr) {
      auto saved = recording->Save(picture, {.exposure_start_ns = frame["exposureStartNs"].get<std::int64_t>(),
                                             .bits = picture.bits,
                                             .gamma = options.gamma.value_or(1.0),
                                             .extension_mm = (*reply)["next"].value("extensionMm", Json())});
      if (!saved) return RefuseOutput(saved);
    }
    reply = frames.Send(run, std::move(frame), BytesOf(picture));
    if (!reply) return reply;
  }
  return (*reply)["autofocus"];
}

}  // namespace lensd::cli
