// Every picture is kept as it comes; which of them are frames of the run is known from the result alone, by the times
// of their exposures.
#include "cli/online/autofocus/autofocus_record.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iterator>

#include "cli/link/lens_info.h"
#include "proto/interfaces.h"
#include "varlink/base64.h"

namespace lensd::cli {
namespace {

using varlink::Json;
namespace fs = std::filesystem;

constexpr int kVersion = 1;

/// Samples of one or two bytes each, lower byte first.
std::vector<std::uint16_t> SamplesOf(const std::vector<std::uint8_t>& bytes, int bits) {
  if (bits <= 8) return {bytes.begin(), bytes.end()};
  std::vector<std::uint16_t> samples;
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
    samples.push_back(static_cast<std::uint16_t>(bytes[i] | bytes[i + 1] << 8));
  }
  return samples;
}

const Json* FocusAxis(const Json& info) {
  const Json& axes = info["axes"];
  const auto focus = std::ranges::find_if(axes, [](const Json& axis) { return axis["axis"] == "focus"; });
  return focus == axes.end() ? nullptr : &*focus;
}

/// The frames' numbers, and the beginnings of their exposures.
std::map<int, const Json*> FramesTold(const Json& result) {
  std::map<int, const Json*> frames;
  for (const Json& sample : result["samples"]) frames.emplace(sample["frame"].get<int>(), &sample);
  return frames;
}

}  // namespace

std::expected<std::unique_ptr<Recording>, Failure> Recording::Create(DaemonClient& link, std::string folder,
                                                                     Json parameters) {
  const Json& name = parameters["lens"];
  auto info = FindInfo(link, name.is_string() ? name.get<std::string>() : "");
  if (!info) return PassOn(info);
  auto status = link.Ask(MethodOfLens("Status"), {{"lens", (*info)["name"]}});
  if (!status) return PassOn(status);
  std::error_code failed;
  fs::create_directories(folder, failed);
  const bool empty = !failed && fs::is_empty(folder, failed);
  if (failed) return Refuse(Exit::CannotWrite, "--record: " + folder + ": " + failed.message());
  if (!empty) {
    return Refuse(Exit::CannotWrite,
                  "--record: the folder " + folder + " is not empty: name one that is not there yet");
  }
  Json f_number = (*status)["lenses"].at(0).value("fNumber", Json());
  return std::unique_ptr<Recording>(
      new Recording(std::move(folder), std::move(parameters), *std::move(info), std::move(f_number)));
}

Recording::~Recording() {
  for (const auto& [start, kept] : kept_) {
    if (kept.file.empty()) continue;
    std::error_code ignored;
    fs::remove(folder_ + "/" + kept.file, ignored);
  }
}

Result<void> Recording::Save(io::Image image, const FrameMark& mark) {
  constexpr std::size_t kMostSamples = std::size_t{256} << 20;
  const std::size_t size = image.samples.size();
  Kept kept{.mark = mark, .image = std::move(image), .file = ""};
  std::unique_lock lock(mutex_);
  if (samples_ + size > kMostSamples) {
    lock.unlock();
    kept.file = "exposure-" + std::to_string(mark.exposure_start_ns) + ".png";
    if (auto written = io::WritePng(folder_ + "/" + kept.file, kept.image); !written) return written;
    kept.image = {};
    lock.lock();
  }
  samples_ += kept.image.samples.size();
  kept_[mark.exposure_start_ns] = std::move(kept);
  saved_.notify_all();
  return {};
}

void Recording::Await(const Json& result, Duration patience) {
  std::int64_t last = 0;
  for (const auto& [number, sample] : FramesTold(result)) {
    last = std::max(last, (*sample)["exposureStartNs"].get<std::int64_t>());
  }
  std::unique_lock lock(mutex_);
  saved_.wait_for(lock, patience, [&] { return !kept_.empty() && kept_.rbegin()->first >= last; });
}

/// Those that are there, written under their final names.
Result<Json> Recording::FramesOf(const Json& result) {
  Json frames = Json::array();
  for (const auto& [number, sample] : FramesTold(result)) {
    const auto found = kept_.find((*sample)["exposureStartNs"].get<std::int64_t>());
    if (found == kept_.end()) continue;
    const Kept& kept = found->second;
    char name[32];
    std::snprintf(name, sizeof name, "%04d.png", number);
    const std::string path = folder_ + "/" + name;
    if (kept.file.empty()) {
      if (auto written = io::WritePng(path, kept.image); !written) return PassOn(written);
    } else {
      std::error_code failed;
      fs::rename(folder_ + "/" + kept.file, path, failed);
      if (failed) return Fail(Code::Io, path + ": " + failed.message());
    }
    frames.push_back({{"frame", number},
                      {"file", name},
                      {"bits", kept.mark.bits},
                      {"gamma", kept.mark.gamma},
                      {"state", (*sample)["state"]},
                      {"position", (*sample)["position"]},
                      {"extensionMm", kept.mark.extension_mm}});
    kept_.erase(found);
  }
  return frames;
}

/// What the search was told of the lens: in millimetres of extension where every frame's is known, else in native
/// units.
Json Recording::SearchOf(const Json& frames) const {
  const auto calibrated = [](const Json& frame) { return frame["extensionMm"].is_number(); };
  const Json& optics = info_["optics"];
  const bool in_mm = optics.is_object() && std::ranges::all_of(frames, calibrated);
  const char* const at = in_mm ? "extensionMm" : "position";
  Json search{{"unit", in_mm ? "mm" : "native"}, {"at", at}, {"blurPx", nullptr}};
  const Json* axis = FocusAxis(info_);
  if (axis == nullptr) return search;
  double lowest = (*axis)["minimum"].get<double>(), highest = (*axis)["maximum"].get<double>();
  double resolution = (*axis)["resolution"].get<double>();
  if (in_mm) {
    const double native = highest - lowest;
    lowest = optics["extensionMinMm"].get<double>();
    highest = optics["extensionMaxMm"].get<double>();
    resolution *= (highest - lowest) / native;
    search["focalLength"] = optics["focalLengthMm"];
    Json pixel = parameters_.value("pixelUm", Json());
    if (!pixel.is_number() && info_["camera"].is_object()) pixel = info_["camera"].value("pixelUm", Json());
    if (pixel.is_number() && f_number_.is_number()) {
      search["blurPx"] = f_number_.get<double>() * pixel.get<double>() * 1e-3;
    }
  }
  if (parameters_.contains("range")) {  // frames were taken in a part of the travel
    const auto place = [&](const Json& frame) { return frame[at].get<double>(); };
    const auto [first, last] = std::ranges::minmax_element(frames, {}, place);
    lowest = first->at(at).get<double>();
    highest = last->at(at).get<double>();
  }
  if (const auto step = parameters_.find("step"); step != parameters_.end()) {
    const double unit = step->contains("relative")      ? resolution / (*axis)["resolution"].get<double>()
                        : step->contains("extensionUm") ? 1e-3
                        : search["blurPx"].is_number()  ? search["blurPx"].get<double>()
                                                        : 0.0;
    search["step"] = unit * step->begin()->get<double>();
  }
  search["lowest"] = lowest;
  search["highest"] = highest;
  search["resolution"] = resolution;
  return search;
}

std::expected<int, Failure> Recording::Finish(const Json& result) {
  const std::lock_guard lock(mutex_);
  auto frames = FramesOf(result);
  if (!frames) return RefuseOutput(frames);
  const int missing = static_cast<int>(FramesTold(result).size() - frames->size());
  if (frames->empty()) return Refuse(Exit::CannotWrite, "--record: no frame of this run could be kept");
  Json run{{"version", kVersion},          {"policy", parameters_.value("policy", "nearest")},
           {"regions", result["regions"]}, {"search", SearchOf(*frames)},
           {"frames", *std::move(frames)}, {"result", result}};
  const std::string text = run.dump(1) + "\n";
  auto written = io::WriteFileAtomically(folder_ + "/run.json", text.data(), text.size());
  if (!written) return RefuseOutput(written);
  return missing;
}

std::expected<std::unique_ptr<ViewRecorder>, Failure> ViewRecorder::Start(const Session& session,
                                                                          Recording& recording) {
  constexpr Duration kPatience = std::chrono::seconds(30);
  const Json& camera = recording.lens()["camera"];
  if (!camera.is_object()) {
    return Refuse(Exit::Unsupported, "--record: this lens has no camera; --frames-from brings pictures of another one");
  }
  auto client = varlink::Client::Connect(session.globals().socket.value_or(std::string(proto::kDefaultSocket)));
  if (!client) return PassOn(client);
  varlink::Call view;
  view.method = MethodOfLens("View");
  view.more = true;
  // Where there is colour, `raw` is not what autofocus sees.
  view.parameters = {{"lens", recording.lens()["name"]},
                     {"encoding", camera.value("colour", false) ? "gray8" : "raw"},
                     {"keepFrames", true}};
  client->SetDeadline(MonotonicClock().Now() + kPatience);
  if (auto sent = client->Send(view); !sent) return PassOn(sent);
  std::unique_ptr<ViewRecorder> recorder(new ViewRecorder(*std::move(client), recording));
  std::unique_lock lock(recorder->mutex_);
  recorder->changed_.wait_for(lock, kPatience, [&] { return recorder->begun_ || recorder->trouble_; });
  if (recorder->trouble_) return std::unexpected(Failure(*recorder->trouble_));
  if (!recorder->begun_) return Refuse(Exit::Timeout, "--record: the camera shows no frame");
  return recorder;
}

ViewRecorder::ViewRecorder(varlink::Client client, Recording& recording)
    : client_(std::move(client)), recording_(recording), stop_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  client_.SetDeadline(std::nullopt);  // the daemon ends a view whose camera shows nothing
  client_.SetInterrupt(stop_);
  thread_ = std::thread([this] { Run(); });
}

ViewRecorder::~ViewRecorder() {
  eventfd_write(stop_, 1);
  thread_.join();
  close(stop_);
}

std::optional<Error> ViewRecorder::trouble() {
  const std::lock_guard lock(mutex_);
  return trouble_;
}

void ViewRecorder::Run() {
  for (;;) {
    auto taken = TakePicture();
    const std::lock_guard lock(mutex_);
    if (taken) {
      begun_ = true;
    } else if (taken.error().code != Code::Cancelled) {
      trouble_ = std::move(taken.error());
    }
    changed_.notify_all();
    if (!taken) return;
  }
}

/// One picture with all its pieces, saved.
Result<void> ViewRecorder::TakePicture() {
  std::vector<std::uint8_t> bytes;
  Json frame, picture;
  for (;;) {
    auto reply = client_.Receive();
    if (!reply) return PassOn(reply);
    if (!reply->error.empty()) return Fail(Code::Io, "the view ended: " + FailureOf(*reply).message);
    const Json& piece = reply->parameters;
    if (bytes.empty()) {
      frame = piece.value("frame", Json());
      picture = piece.value("picture", Json());
    }
    auto part = varlink::DecodeBase64(piece.value("data", ""));
    if (part && piece.value("offset", std::size_t{0}) != bytes.size())
      part = Fail(Code::Protocol, "a piece is missing");
    if (!part) return PassOn(part);
    bytes.insert(bytes.end(), part->begin(), part->end());
    if (bytes.size() >= piece.value("size", std::size_t{0})) break;
  }
  const int bits = picture.value("bits", 8);
  io::Image image;
  image.width = picture.value("widthPx", 0);
  image.height = picture.value("heightPx", 0);
  image.bits = bits <= 8 ? 8 : 16;
  image.samples = SamplesOf(bytes, bits);
  if (!frame["exposureStartNs"].is_number()) return Fail(Code::Unsupported, "this camera does not say when it exposes");
  return recording_.Save(std::move(image), {.exposure_start_ns = frame["exposureStartNs"].get<std::int64_t>(),
                                            .bits = bits,
                                            .gamma = picture.value("gamma", 1.0),
                                            .extension_mm = frame.value("extensionMm", Json())});
}

}  // namespace lensd::cli
