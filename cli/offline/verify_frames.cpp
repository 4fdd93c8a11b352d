// The references are split into two halves that are averaged each: by the difference of two frames that should be alike
// their noise is known, and half of it is as noisy as the mean of both, however many frames each half has.
#include "cli/offline/verify_frames.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "base/quantity_text.h"
#include "cli/merge/shots.h"
#include "io/png.h"

namespace lensd::cli {
namespace {

using verify::Plane;

constexpr std::uint16_t kBeyondSixteenBits = 65535;  // of a depth map: so far, or anything beyond

std::string FrameSize(int width, int height) {
  return std::to_string(width) + "x" + std::to_string(height) + " px";
}

/// Where brightness is cut off, blur is not that of a disk any more.
std::optional<std::string> ClippedText(const std::string& path, const Plane& plane, int bits) {
  constexpr double kMostShare = 0.001;
  const auto full = static_cast<float>((1 << bits) - 1);
  const double clipped = static_cast<double>(std::ranges::count(plane.values, full));
  const double share = clipped / static_cast<double>(plane.values.size());
  if (share <= kMostShare) return std::nullopt;
  return Short(100.0 * share, 2) + " % of the pixels of " + path +
         " are at full scale, where brightness is cut off: the blur measured there is wrong; expose for a shorter time";
}

std::expected<Plane, Failure> ReadPlane(const std::string& path, std::optional<std::string>& doubt) {
  const auto image = io::ReadPng(path);
  if (!image) return RefuseInput(image);
  Plane plane{.width = image->width, .height = image->height, .values = {}};
  const std::size_t channels = image->channels, green = channels == 3 ? 1 : 0;
  plane.values.reserve(image->samples.size() / channels);
  for (std::size_t i = green; i < image->samples.size(); i += channels) plane.values.push_back(image->samples[i]);
  if (!doubt) doubt = ClippedText(path, plane, image->bits);
  return plane;
}

/// A frame of the picture's size.
std::expected<Plane, Failure> ReadAlike(const std::string& path, const Plane& picture, const std::string& like,
                                        std::optional<std::string>& doubt) {
  auto plane = ReadPlane(path, doubt);
  if (!plane || (plane->width == picture.width && plane->height == picture.height)) return plane;
  return Refuse(Exit::BadData, path + " has " + FrameSize(plane->width, plane->height) + ", the picture " + like +
                                   " has " + FrameSize(picture.width, picture.height) +
                                   "; take all frames with the same camera settings");
}

void AddTo(Plane& sum, const Plane& plane) {
  if (sum.values.empty()) {
    sum = plane;
    return;
  }
  for (std::size_t i = 0; i < sum.values.size(); ++i) sum.values[i] += plane.values[i];
}

std::expected<void, Failure> ReadReferences(const VerifyFiles& files, VerifyFrames& read) {
  verify::FramesToCompare& frames = read.frames;
  for (std::size_t i = 0; i < files.references.size(); ++i) {
    const auto plane = ReadAlike(files.references[i], frames.picture, files.picture, read.doubt);
    if (!plane) return PassOn(plane);
    AddTo(i % 2 == 0 ? frames.reference_a : frames.reference_b, *plane);
  }
  const std::size_t second = files.references.size() / 2, first = files.references.size() - second;
  for (const auto& [half, count] : {std::pair(&frames.reference_a, first), {&frames.reference_b, second}}) {
    if (count == 1) continue;
    for (float& value : half->values) value /= static_cast<float>(count);
  }
  return {};
}

std::expected<std::vector<float>, Failure> ReadDepths(const VerifyFiles& files, const Plane& picture) {
  const auto image = io::ReadPng(files.depth_map);
  if (!image) return RefuseInput(image);
  if (image->bits != 16 || image->channels != 1) {
    return Refuse(Exit::BadData,
                  files.depth_map + ": a depth map must be a grey PNG of 16 bits in millimetres, this one has " +
                      std::to_string(image->bits) + " bits" + (image->channels == 3 ? " in colour" : ""));
  }
  if (image->width != picture.width || image->height != picture.height) {
    return Refuse(Exit::BadData, files.depth_map + ": the depth map has " + FrameSize(image->width, image->height) +
                                     ", the picture " + files.picture + " has " +
                                     FrameSize(picture.width, picture.height) + "; it needs a depth for each pixel");
  }
  std::vector<float> depth_m;
  depth_m.reserve(image->samples.size());
  for (const std::uint16_t millimetres : image->samples) {
    depth_m.push_back(millimetres == kBeyondSixteenBits ? 0.0f : static_cast<float>(millimetres) / 1000);
  }
  return depth_m;
}

/// What the files say of themselves: the picture first, then the references.
std::expected<std::vector<Shot>, Failure> ReadNotes(const VerifyFiles& files) {
  std::vector<Shot> shots;
  for (std::size_t i = 0; i <= files.references.size(); ++i) {
    auto shot = ReadShot(i == 0 ? files.picture : files.references[i - 1]);
    if (!shot) return PassOn(shot);
    shots.push_back(*std::move(shot));
  }
  return shots;
}

std::expected<void, Failure> CheckLens(const std::vector<Shot>& shots) {
  for (const Shot& shot : shots) {
    if (shot.lens.empty() || shots.front().lens.empty() || shot.lens == shots.front().lens) continue;
    return Refuse(Exit::BadData, shots.front().file + " was taken by the lens " + shots.front().lens + " and " +
                                     shot.file + " by the lens " + shot.lens + "; compare pictures of one lens");
  }
  return {};
}

/// A reference in another focus has a blur of its own, which is then taken for the picture's.
std::optional<std::string> RefocusedText(const std::vector<Shot>& shots) {
  constexpr double kMostBlurMm = 0.001;
  const Shot& picture = shots.front();
  for (const Shot& shot : shots) {
    if (!picture.extension_mm || !shot.extension_mm || !picture.f_number) continue;
    if (std::abs(*shot.extension_mm - *picture.extension_mm) / *picture.f_number <= kMostBlurMm) continue;
    return picture.file + " and " + shot.file + " were taken in different focus (extension " +
           Short(*picture.extension_mm, 6) + " mm and " + Short(*shot.extension_mm, 6) +
           " mm), which shows as blur: take references without moving the focus";
  }
  return std::nullopt;
}

std::expected<double, Failure> OpeningOf(const std::vector<Shot>& shots) {
  constexpr double kAlike = 0.02, kMost = 0.99;
  const Shot &picture = shots.front(), &first = shots[1];
  for (const Shot& shot : shots) {
    if (shot.f_number && *shot.f_number > 0.0) continue;
    return Refuse(Exit::BadData, shot.file +
                                     " does not say its f-number, as pictures of lensctl snapshot do where the "
                                     "aperture is calibrated; give --reference-opening: the picture's f-number over "
                                     "the references'");
  }
  for (std::size_t i = 2; i < shots.size(); ++i) {
    if (std::abs(*shots[i].f_number / *first.f_number - 1.0) <= kAlike) continue;
    return Refuse(Exit::BadData, first.file + " was taken at f/" + Short(*first.f_number) + " and " + shots[i].file +
                                     " at f/" + Short(*shots[i].f_number) + "; take all references at one f-number");
  }
  const double opening = *picture.f_number / *first.f_number;
  if (opening <= kMost) return opening;
  return Refuse(Exit::BadData, first.file + " was taken at f/" + Short(*first.f_number) + " and the picture " +
                                   picture.file + " at f/" + Short(*picture.f_number) +
                                   ": references need a smaller aperture than the picture, such as f/16");
}

std::expected<void, Failure> CheckReferences(const std::vector<std::string>& paths) {
  if (paths.size() < 2) {
    return Refuse(Exit::Usage,
                  "--reference is needed twice or more: what two frames of a small aperture differ by is their noise; "
                  "write --reference A.png --reference B.png");
  }
  std::set<std::filesystem::path> seen;
  for (const std::string& path : paths) {
    std::error_code unresolved;  // of a file that is not there, which reading it says better
    const auto real = std::filesystem::weakly_canonical(path, unresolved);
    if (unresolved || seen.insert(real).second) continue;
    return Refuse(Exit::Usage, "--reference '" + path + "' is given twice: one frame does not show its own noise");
  }
  return {};
}

}  // namespace

std::expected<VerifyFrames, Failure> ReadVerifyFrames(const VerifyFiles& files, std::optional<double> opening) {
  if (auto good = CheckReferences(files.references); !good) return PassOn(good);
  const auto shots = ReadNotes(files);
  if (!shots) return PassOn(shots);
  if (auto good = CheckLens(*shots); !good) return PassOn(good);
  const auto ratio = opening ? std::expected<double, Failure>(*opening) : OpeningOf(*shots);
  if (!ratio) return PassOn(ratio);
  VerifyFrames read;
  read.frames.reference_opening = *ratio;
  read.doubt = RefocusedText(*shots);
  auto picture = ReadPlane(files.picture, read.doubt);
  if (!picture) return PassOn(picture);
  read.frames.picture = *std::move(picture);
  if (auto done = ReadReferences(files, read); !done) return PassOn(done);
  auto depths = ReadDepths(files, read.frames.picture);
  if (!depths) return PassOn(depths);
  read.depth_m = *std::move(depths);
  return read;
}

}  // namespace lensd::cli
