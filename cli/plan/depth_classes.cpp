// Depth maps and masks into the depths that each class occupies, once each.
#include "cli/plan/depth_classes.h"

#include <optional>

#include "io/png.h"
#include "optics/depth_extremes.h"

namespace lensd::cli {
namespace {

constexpr int kDepthValues = 1 << 16;

Result<io::Image> ReadGrey(const std::string& path, int bits, const char* what) {
  auto image = io::ReadPng(path);
  if (!image) return image;
  if (image->bits == bits && image->channels == 1) return image;
  return Fail(Code::BadData, path + ": " + what + " must be a grey PNG of " + std::to_string(bits) +
                                 " bits, this one has " + std::to_string(image->bits) + " bits" +
                                 (image->channels == 3 ? " in colour" : ""));
}

std::string Size(const io::Image& image) {
  return std::to_string(image.width) + "x" + std::to_string(image.height);
}

/// Every depth of a class, each once: one table of which depths occur.
OccupiedDepths EveryDepth(const io::Image& depths, const io::Image* classes, int wanted) {
  std::vector<unsigned char> seen(2 * kDepthValues);  // the second half takes what is of another class: no branch
  for (std::size_t i = 0; i < depths.samples.size(); ++i) {
    const bool other = classes != nullptr && classes->samples[i] != wanted;
    seen[depths.samples[i] + (other ? kDepthValues : 0)] = 1;
  }
  OccupiedDepths found;
  for (int depth = 1; depth < kDepthValues; ++depth) {
    if (seen[static_cast<std::size_t>(depth)] != 0) found.push_back(depth);
  }
  return found;
}

OccupiedDepths Ends(const io::Image& depths, const io::Image* classes, int wanted) {
  const optics::DepthExtremes ends =
      classes != nullptr ? optics::ExtremesOfClass(depths.samples, classes->samples, static_cast<std::uint16_t>(wanted))
                         : optics::ExtremesOfDepths(depths.samples);
  if (ends.farthest == 0) return {};
  return ends.nearest == ends.farthest ? OccupiedDepths{ends.nearest} : OccupiedDepths{ends.nearest, ends.farthest};
}

Result<std::optional<io::Image>> ReadMask(const std::string& path, const io::Image& depths,
                                          const std::string& depth_map) {
  if (path.empty()) return std::nullopt;
  auto classes = ReadGrey(path, 8, "a mask");
  if (!classes) return PassOn(classes);
  if (classes->width != depths.width || classes->height != depths.height) {
    return Fail(Code::BadData, path + ": the mask is " + Size(*classes) + " px, but the depth map " + depth_map +
                                   " is " + Size(depths) + " px");
  }
  return *std::move(classes);
}

}  // namespace

Result<std::map<int, OccupiedDepths>> ReadDepthClasses(const std::string& depth_map, const std::string& mask,
                                                       const std::vector<WantedClass>& wanted) {
  const auto depths = ReadGrey(depth_map, 16, "a depth map");
  if (!depths) return PassOn(depths);
  const auto read = ReadMask(mask, *depths, depth_map);
  if (!read) return PassOn(read);
  const io::Image* classes = *read ? &**read : nullptr;
  std::map<int, OccupiedDepths> found;
  for (const auto& [number, every_depth] : wanted) {
    OccupiedDepths occupied;
    if (classes != nullptr || number == 1) {
      occupied = every_depth ? EveryDepth(*depths, classes, number) : Ends(*depths, classes, number);
    }
    const std::string name = "class @" + std::to_string(number);
    if (occupied.empty()) {
      return Fail(Code::BadData, (mask.empty() ? depth_map : mask) + ": " + name + " has no pixel of known depth");
    }
    if (occupied.back() == kDepthValues - 1) {
      const std::string where = depth_map + ": ";
      return Fail(Code::BadData,
                  (where + name).append(" holds 65535 mm, where 16 bits overflow; write 0 where the depth is unknown"));
    }
    found.emplace(number, std::move(occupied));
  }
  return found;
}

}  // namespace lensd::cli
