// Depth maps and masks: the depths that a class is said to have are those that a plain look finds. Bytes: the kind of
// picture, its width, the mask's width, a class, then samples.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <set>
#include <span>
#include <vector>

#include "cli/plan/depth_classes.h"
#include "io/png.h"
#include "memory_file.h"

namespace {

using namespace lensd;

io::Image Picture(std::span<const std::uint8_t> bytes, int width, int bits) {
  io::Image image{.width = width, .height = 1, .channels = 1, .bits = bits, .samples = {}};
  const std::size_t each = bits == 16 ? 2 : 1;
  const std::size_t rows = std::max<std::size_t>(1, bytes.size() / (each * static_cast<std::size_t>(width)));
  image.height = static_cast<int>(rows);
  for (std::size_t i = 0; i < rows * static_cast<std::size_t>(width); ++i) {
    const auto byte = [&](std::size_t at) -> unsigned { return at < bytes.size() ? bytes[at] : 0U; };
    image.samples.push_back(static_cast<std::uint16_t>(each == 2 ? byte(2 * i) << 8U | byte(2 * i + 1) : byte(i)));
  }
  return image;
}

std::set<int> Seen(const io::Image& depths, const io::Image* classes, int wanted) {
  std::set<int> found;
  for (std::size_t i = 0; i < depths.samples.size(); ++i) {
    const int of = classes != nullptr ? classes->samples[i] : 1;
    if (of == wanted && depths.samples[i] != 0) found.insert(depths.samples[i]);
  }
  return found;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kHeader = 4;
  if (size < kHeader) return 0;
  const std::span<const std::uint8_t> rest(data + kHeader, size - kHeader);
  const int wanted = data[3] == 0 ? 1 : data[3];
  const io::Image depths = Picture(rest, data[1] % 64 + 1, (data[0] & 1U) != 0 ? 8 : 16);
  const auto encoded = io::EncodePng(depths);
  if (!encoded) __builtin_trap();
  const fuzz::MemoryFile file(encoded->data(), encoded->size());
  const bool masked = (data[0] & 2U) != 0;
  io::Image classes = Picture(rest.subspan(rest.size() / 2), data[2] % 64 + 1, 8);
  if ((data[0] & 4U) != 0) {  // one that fits
    classes.width = depths.width;
    classes.height = depths.height;
    classes.samples.resize(depths.samples.size());
  }
  const auto mask = io::EncodePng(classes);
  if (!mask) __builtin_trap();
  const fuzz::MemoryFile mask_file(mask->data(), mask->size());
  const bool every = (data[0] & 8U) != 0;
  const auto found = cli::ReadDepthClasses(file.path(), masked ? mask_file.path() : "", {{wanted, every}});
  const bool fits = !masked || (classes.width == depths.width && classes.height == depths.height);
  const std::set<int> seen =
      fits ? Seen(depths, masked ? &classes : nullptr, wanted) : std::set<int>();  // a class that nothing has is empty
  const bool usable = depths.bits == 16 && fits && !seen.empty() && *seen.rbegin() != 65535;
  if (found.has_value() != usable) __builtin_trap();
  if (!found) return 0;
  const cli::OccupiedDepths& told = found->at(wanted);
  if (told.empty() || told.front() != *seen.begin() || told.back() != *seen.rbegin()) __builtin_trap();
  if (every && !std::ranges::equal(told, seen)) __builtin_trap();
  return 0;
}
