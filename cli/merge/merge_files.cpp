// Three times through the frames: how they lie over each other, where each pixel is sharp, and the picture of it.
// Frames are read again rather than all kept, but for as many as fit a fixed budget.
#include "cli/merge/merge_files.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "cli/merge/shots.h"
#include "cli/text/text.h"
#include "io/picture_notes.h"
#include "io/png.h"
#include "merge/compose.h"
#include "merge/depth.h"
#include "merge/drift.h"
#include "varlink/json.h"

namespace lensd::cli {
namespace {

using varlink::Json;

constexpr std::size_t kKeptSamples = std::size_t{128} << 20U;  // of two bytes each

/// The frames of a stack, from disk or from what was kept of the last time.
class Frames {
 public:
  explicit Frames(const ShotStack& stack) : stack_(stack), kept_(stack.shots.size()) {}

  std::expected<merge::Picture, Failure> At(std::size_t shot) {
    if (kept_[shot].samples.empty()) {
      auto image = io::ReadPng(stack_.shots[shot].file);
      if (!image) return RefuseInput(image);
      if (auto other = Differs(*image, shot)) return PassOn(*std::move(other));
      bits_ = std::max(bits_, image->bits);
      if (image->samples.size() > budget_) return PictureOf(*image);
      budget_ -= image->samples.size();
      kept_[shot] = *std::move(image);
    }
    return PictureOf(kept_[shot]);
  }
  std::size_t size() const { return kept_.size(); }
  int bits() const { return bits_; }

 private:
  std::optional<Failure> Differs(const io::Image& image, std::size_t shot) {
    if (first_.width == 0) first_ = {image.width, image.height, image.channels, image.bits, {}};
    const auto text = [](const io::Image& of) {
      return std::to_string(of.width) + "x" + std::to_string(of.height) + " px, " + std::to_string(of.bits) + " bits" +
             (of.channels == 3 ? " in colour" : "");
    };
    if (text(image) == text(first_)) return std::nullopt;
    return Failure(Exit::BadData, stack_.shots[shot].file + " has " + text(image) + ", other frames " + text(first_) +
                                      "; a stack is of one kind");
  }
  static merge::Picture PictureOf(const io::Image& image) {
    return {image.width, image.height, image.channels, {image.samples.begin(), image.samples.end()}};
  }

  const ShotStack& stack_;
  std::vector<io::Image> kept_;
  io::Image first_{};
  int bits_ = 8;
  std::size_t budget_ = kKeptSamples;
};

/// How large the lens itself says that its pictures are: as its focal length where the picture keeps its size while
/// only the extension changes, and as the distance of the sensor where it grows with that.
std::vector<std::vector<double>> LawsOf(const ShotStack& stack) {
  std::vector<double> grows, keeps;
  for (const Shot& shot : stack.shots) {
    if (!shot.focal_length_mm || !shot.extension_mm) return {};
    grows.push_back(*shot.focal_length_mm + *shot.extension_mm);
    keeps.push_back(*shot.focal_length_mm);
    if (!(grows.back() > 0.0 && keeps.back() > 0.0)) return {};
  }
  return {grows, keeps};
}
constexpr std::array kLawNames = {"lens", "lens-telecentric"};

std::expected<merge::Alignment, Failure> Lay(Frames& frames, const ShotStack& stack) {
  const auto laws = LawsOf(stack);
  std::vector<merge::Drift> drifts;
  auto before = frames.At(0);
  if (!before) return PassOn(before);
  for (std::size_t i = 1; i < frames.size(); ++i) {
    auto here = frames.At(i);
    if (!here) return PassOn(here);
    drifts.push_back(merge::MeasureDrift(*before, *here, laws.empty() ? 1.0 : laws[0][i] / laws[0][i - 1]));
    before = std::move(here);
  }
  return merge::Align(drifts, laws, *before);
}

/// Files are checked and read by now: what fails here is our own fault.
template <class T>
std::unexpected<Failure> Broken(const Result<T>& failed) {
  return std::unexpected(Failure(failed.error()));
}

std::expected<merge::DepthMap, Failure> FindDepth(Frames& frames, const std::vector<merge::Station>& stations,
                                                  merge::Prefer prefer) {
  auto finder = merge::DepthFinder::Create(stations, prefer);
  if (!finder) return Broken(finder);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const auto frame = frames.At(i);
    if (!frame) return PassOn(frame);
    if (auto added = finder->Add(*frame); !added) return Broken(added);
  }
  auto map = finder->Finish();
  if (!map) return Broken(map);
  return *std::move(map);
}

io::Image ImageOf(const merge::Picture& picture, int bits) {
  io::Image image{picture.width, picture.height, picture.channels, bits, {}};
  const auto most = static_cast<float>((1 << bits) - 1);
  image.samples.reserve(picture.samples.size());
  for (const float sample : picture.samples) {
    image.samples.push_back(static_cast<std::uint16_t>(std::lround(std::clamp(sample, 0.0f, most))));
  }
  return image;
}

/// As scenes and `plan --depth-map` read it: millimetres, 0 where nothing is known or it is too far for 16 bits.
io::Image DepthImage(const merge::DepthMap& map) {
  io::Image image{map.width, map.height, 1, 16, {}};
  image.samples.reserve(map.place.size());
  for (const float vergence : map.place) {
    const double depth_mm = std::isnan(vergence) || vergence <= 0.0f ? 0.0 : 1000.0 / static_cast<double>(vergence);
    image.samples.push_back(depth_mm < 65534.5 ? static_cast<std::uint16_t>(std::lround(depth_mm)) : 0);
  }
  return image;
}

/// The picture's file says what it is of, and that it is no frame.
std::expected<void, Failure> Write(const std::string& path, const io::Image& image, const ShotStack& stack) {
  auto bytes = io::EncodePng(image);
  if (!bytes) return RefuseOutput(bytes);
  const Shot& first = stack.shots.front();
  io::PictureNotes notes{.software = "lensctl " LENSD_VERSION, .lens = first.lens, .f_number = first.f_number};
  notes.own = {{"MergedFrames", std::to_string(stack.shots.size())}};
  if (stack.order == ShotOrder::Vergence) {
    notes.own.emplace_back("FarD", varlink::WriteJson(Json(stack.PlaceOf(0))));
    notes.own.emplace_back("NearD", varlink::WriteJson(Json(stack.PlaceOf(stack.shots.size() - 1))));
  }
  if (auto added = io::AddNotes(*bytes, notes); !added) return RefuseOutput(added);
  if (auto written = io::WriteFileAtomically(path, bytes->data(), bytes->size()); !written)
    return RefuseOutput(written);
  return {};
}

std::expected<void, Failure> WritePicture(Frames& frames, const std::vector<merge::Station>& stations,
                                          const merge::DepthMap& map, const std::string& path, const ShotStack& stack) {
  merge::Composer composer(stations, map);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const auto frame = frames.At(i);
    if (!frame) return PassOn(frame);
    if (auto added = composer.Add(*frame); !added) return Broken(added);
  }
  return Write(path, ImageOf(composer.Finish(), frames.bits()), stack);
}

/// What a person would want to know before trusting the result.
void Warn(Session& session, const merge::Alignment& alignment, const ShotStack& stack) {
  constexpr double kMoved_px = 2.0;
  if (alignment.largest_shift_px > kMoved_px) {
    session.Remark("between " + stack.shots[alignment.shifted_after].file + " and " +
                   stack.shots[alignment.shifted_after + 1].file + " the picture moved by " +
                   Short(alignment.largest_shift_px, 2) + " px, which is not made up for: hold the camera still");
  }
  if (!alignment.law && !LawsOf(stack).empty()) {
    session.Remark("the pictures do not grow as the lens says (" + Short(alignment.misfit_px, 2) +
                   " px in the corners): the pictures were aligned by their measured growth; [breathing] in the "
                   "calibration describes it to lensd");
  }
}

std::expected<void, Failure> CheckPlaces(const ShotStack& stack, const MergeText& text) {
  if (stack.order == ShotOrder::Vergence || (text.depth.empty() && text.prefer != "near")) return {};
  return Refuse(Exit::BadData,
                stack.shots.front().file + (text.depth.empty() ? ": --prefer near" : ": --depth") +
                    " needs the distance each frame was focused at, and these frames do not say it: the lens was not "
                    "calibrated (lensctl calibrate), or they are not of lensctl");
}

Json Answer(const ShotStack& stack, const merge::Alignment& alignment, const merge::DepthMap& map,
            const MergeText& text) {
  Json frames = Json::array();
  for (std::size_t i = 0; i < stack.shots.size(); ++i) {
    const Shot& shot = stack.shots[i];
    frames.push_back({{"file", shot.file},
                      {"vergenceD", shot.vergence_d ? Json(*shot.vergence_d) : Json()},
                      {"magnification", alignment.scales[i] / alignment.scales.front()}});
  }
  constexpr std::array kOrders = {"vergence", "position", "name"};
  return {{"frames", frames},
          {"order", kOrders[static_cast<std::size_t>(stack.order)]},
          {"alignedBy", alignment.law ? kLawNames.at(*alignment.law) : "pictures"},
          {"misfitPx", alignment.misfit_px},
          {"shiftPx", alignment.largest_shift_px},
          {"known", map.known},
          {"picture", text.picture.empty() ? Json() : Json(text.picture)},
          {"depthMap", text.depth.empty() ? Json() : Json(text.depth)}};
}

}  // namespace

void AddMergeOptions(CLI::App& command, MergeText& text) {
  command.add_option("--depth", text.depth, "the depth of each pixel: 16-bit PNG in mm, 0 where it is not known")
      ->type_name("FILE");
  command.add_option("--prefer", text.prefer, "near: a pixel that is sharp in two frames is taken from the nearer one")
      ->type_name("WHICH")
      ->check(CLI::IsMember({"near", "sharper"}));
}

std::expected<void, Failure> CheckMerge(const MergeText& text) {
  if (!text.prefer.empty() && text.picture.empty() && text.depth.empty()) {
    return Refuse(Exit::Usage, "--prefer is about what is merged; say what to make: --merge or --depth");
  }
  for (const std::string* path : {&text.picture, &text.depth}) {
    if (path->empty() || std::filesystem::path(*path).extension() == ".png") continue;
    return Refuse(Exit::Usage, "'" + *path + "': what is merged is written as PNG; let its name end in .png");
  }
  return {};
}

std::expected<Json, Failure> MergeFiles(Session& session, const std::vector<std::string>& paths,
                                        const MergeText& text) {
  const auto stack = ReadShots(paths);
  if (!stack) return PassOn(stack);
  if (auto good = CheckPlaces(*stack, text); !good) return PassOn(good);
  Frames frames(*stack);
  const auto alignment = Lay(frames, *stack);
  if (!alignment) return PassOn(alignment);
  Warn(session, *alignment, *stack);
  std::vector<merge::Station> stations;
  for (std::size_t i = 0; i < frames.size(); ++i) stations.push_back({stack->PlaceOf(i), alignment->scales[i]});
  const auto map = FindDepth(frames, stations, text.prefer == "near" ? merge::Prefer::Later : merge::Prefer::Sharper);
  if (!map) return PassOn(map);
  if (!text.picture.empty()) {
    if (auto done = WritePicture(frames, stations, *map, text.picture, *stack); !done) return PassOn(done);
  }
  if (!text.depth.empty()) {
    if (auto done = Write(text.depth, DepthImage(*map), *stack); !done) return PassOn(done);
  }
  return Answer(*stack, *alignment, *map, text);
}

std::string MergedText(const Json& merged) {
  const auto& frames = merged["frames"];
  std::string text = std::to_string(frames.size()) + " frames";
  if (merged["order"] == "vergence") {
    text += " from " + DepthText(Dioptres{frames.front()["vergenceD"]}) + " to " +
            DepthText(Dioptres{frames.back()["vergenceD"]});
  }
  text += "; textured: " + Short(100.0 * merged["known"].get<double>(), 3) + " % of the picture";
  for (const auto& [key, what] : {std::pair("picture", ": sharp all over"), std::pair("depthMap", ": depth in mm")}) {
    if (merged[key].is_string()) text += "\n" + merged[key].get<std::string>() + what;
  }
  return text;
}

}  // namespace lensd::cli
