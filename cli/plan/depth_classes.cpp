#include "cli/plan/depth_classes.h"

#include <array>

#include "io/png.h"

namespace lensd::cli {
namespace {

constexpr int kDepths = 1 << 16;
constexpr int kClasses = 256;

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

/// One table a class of which depths occur. Classes nobody asked for share a table that is thrown away, so that the
/// pass has no branch.
class Occupancy {
 public:
  explicit Occupancy(const std::vector<int>& wanted) : seen_((wanted.size() + 1) * kDepths) {
    for (std::size_t i = 0; i < wanted.size(); ++i) table_[wanted[i]] = (i + 1) * kDepths;
  }

  void Mark(const io::Image& depths, const io::Image* classes) {
    for (std::size_t i = 0; i < depths.samples.size(); ++i) {
      const std::size_t pixel_class = classes != nullptr ? classes->samples[i] : 1;
      seen_[table_[pixel_class] + depths.samples[i]] = 1;
    }
  }

  OccupiedDepths Of(int pixel_class) const {
    OccupiedDepths depths;
    const auto* table = seen_.data() + table_[pixel_class];
    for (int depth = 1; depth < kDepths; ++depth) {
      if (table[depth] != 0) depths.push_back(depth);
    }
    return depths;
  }

 private:
  std::array<std::size_t, kClasses> table_{};
  std::vector<unsigned char> seen_;
};

}  // namespace

Result<std::map<int, OccupiedDepths>> ReadDepthClasses(const std::string& depth_map, const std::string& mask,
                                                       const std::vector<int>& wanted) {
  const auto depths = ReadGrey(depth_map, 16, "a depth map");
  if (!depths) return std::unexpected(depths.error());
  Occupancy occupancy(wanted);
  if (mask.empty()) {
    occupancy.Mark(*depths, nullptr);
  } else {
    const auto classes = ReadGrey(mask, 8, "a mask");
    if (!classes) return std::unexpected(classes.error());
    if (classes->width != depths->width || classes->height != depths->height) {
      return Fail(Code::BadData, mask + ": the mask is " + Size(*classes) + " px, but the depth map " + depth_map +
                                     " is " + Size(*depths) + " px");
    }
    occupancy.Mark(*depths, &*classes);
  }
  std::map<int, OccupiedDepths> found;
  for (const int pixel_class : wanted) {
    OccupiedDepths occupied = occupancy.Of(pixel_class);
    const std::string name = "class @" + std::to_string(pixel_class);
    if (occupied.empty()) {
      return Fail(Code::BadData, (mask.empty() ? depth_map : mask) + ": " + name + " has no pixel of known depth");
    }
    if (occupied.back() == kDepths - 1) {
      return Fail(Code::BadData, depth_map + ": " + name +
                                     " holds 65535 mm, where 16 bits overflow; write 0 where the depth is unknown");
    }
    found.emplace(pixel_class, std::move(occupied));
  }
  return found;
}

}  // namespace lensd::cli
