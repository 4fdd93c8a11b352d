// From a frame to what is sent of it: cut out, averaged down, and only then brought to the bits of its encoding, so
// that a smaller picture is no darker and no coarser than the large one.
#include "daemon/pictures/picture.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <string_view>
#include <utility>

#include "autofocus/measures.h"
#include "autofocus/sharpness.h"
#include "daemon/wire/lens_json.h"
#include "daemon/wire/refusal.h"
#include "drivers/pixels/jpeg.h"
#include "io/png.h"

namespace lensd::daemon {
namespace {

using PixelSamples = std::vector<std::uint16_t>;

constexpr std::array<std::string_view, 5> kEncodings = {"png", "jpeg", "raw", "gray8", "rgb8"};
constexpr double kScreenGamma = 2.2;
constexpr int kJpegQuality = 85;
constexpr std::int64_t kEnoughSamples = std::int64_t{1} << 20;

}  // namespace

Result<drivers::Region> RegionOf(const varlink::Json& region, const std::string& path) {
  const auto number = [&](const char* key) { return region[key].get<double>(); };
  const drivers::Region part{number("x"), number("y"), number("w"), number("h")};
  constexpr double kRounding = 1e-9;
  const auto inside = [](double from, double size) {
    return from >= 0.0 && size > 0.0 && from + size <= 1.0 + kRounding;
  };
  if (!inside(part.x, part.width) || !inside(part.y, part.height)) {
    return PassOn(
        Wrong("region: x, y, w and h are fractions of the frame; w and h are above 0, and x + w and y + h at most 1",
              {.parameter = path}));
  }
  return part;
}

namespace {

/// From the first pixel to behind the last of `share` of `px` pixels from `from`.
std::pair<int, int> Span(double from, double share, int px) {
  const int first = std::clamp(static_cast<int>(std::lround(from * px)), 0, px - 1);
  const int end = std::clamp(static_cast<int>(std::lround((from + share) * px)), first + 1, px);
  return {first, end};
}

/// Channels of what is shown, and their samples over the whole frame.
struct Source {
  const PixelSamples& samples;
  int channels;
};

PixelSamples Cut(const Source& source, int frame_width, const FrameWindow& window) {
  const auto row = static_cast<std::size_t>(window.width * source.channels);
  PixelSamples cut(row * static_cast<std::size_t>(window.height));
  for (int y = 0; y < window.height; ++y) {
    const auto from = (static_cast<std::ptrdiff_t>(window.y + y) * frame_width + window.x) * source.channels;
    std::copy_n(source.samples.begin() + from, row,
                cut.begin() + static_cast<std::ptrdiff_t>(y) * std::ssize(cut) / window.height);
  }
  return cut;
}

/// Each pixel is the mean of the whole pixels that fall into it.
PixelSamples AveragedDown(const PixelSamples& samples, int width, int height, int channels,
                          const PictureWish::Size& to) {
  PixelSamples small;
  small.reserve(static_cast<std::size_t>(to.width) * static_cast<std::size_t>(to.height) *
                static_cast<std::size_t>(channels));
  const auto begin = [](int i, int from, int parts) {
    return static_cast<int>(static_cast<std::int64_t>(i) * from / parts);
  };
  for (int y = 0; y < to.height; ++y) {
    const int top = begin(y, height, to.height), bottom = begin(y + 1, height, to.height);
    for (int x = 0; x < to.width; ++x) {
      const int left = begin(x, width, to.width), right = begin(x + 1, width, to.width);
      const auto count = static_cast<std::uint64_t>(bottom - top) * static_cast<std::uint64_t>(right - left);
      for (int channel = 0; channel < channels; ++channel) {
        std::uint64_t sum = count / 2;
        for (int row = top; row < bottom; ++row) {
          const auto* at = samples.data() + (static_cast<std::ptrdiff_t>(row) * width + left) * channels + channel;
          for (int i = left; i < right; ++i, at += channels) sum += *at;
        }
        small.push_back(static_cast<std::uint16_t>(sum / count));
      }
    }
  }
  return small;
}

PictureWish::Size FitInto(const PictureWish::Size& most, int width, int height) {
  const double factor = std::min({1.0, 1.0 * most.width / width, 1.0 * most.height / height});
  const auto part = [&](int px) { return std::max(1, static_cast<int>(std::lround(px * factor))); };
  return {part(width), part(height)};
}

/// PNG knows 8 and 16 bits: others are scaled to the full range of 16.
Result<std::vector<std::uint8_t>> EncodeAsPng(Picture& picture, PixelSamples samples) {
  if (picture.bits != 8 && picture.bits != 16) {
    const std::uint32_t full = (1u << picture.bits) - 1;
    for (std::uint16_t& sample : samples) {
      sample = static_cast<std::uint16_t>((std::min<std::uint32_t>(sample, full) * 65535u + full / 2) / full);
    }
  }
  return io::EncodePng(
      {picture.width, picture.height, picture.channels, picture.bits == 8 ? 8 : 16, std::move(samples)});
}

std::vector<std::uint8_t> AsBytes(const PixelSamples& samples, int bits) {
  static_assert(std::endian::native == std::endian::little);
  if (bits <= 8) return {samples.begin(), samples.end()};
  std::vector<std::uint8_t> bytes;
  bytes.reserve(2 * samples.size());
  for (const std::uint16_t sample : samples) {
    bytes.push_back(static_cast<std::uint8_t>(sample));
    bytes.push_back(static_cast<std::uint8_t>(sample >> 8));
  }
  return bytes;
}

std::vector<std::uint8_t> Through(const std::vector<std::uint8_t>& table, const PixelSamples& samples) {
  std::vector<std::uint8_t> bytes(samples.size());
  const std::size_t last = table.size() - 1;
  std::ranges::transform(samples, bytes.begin(),
                         [&](std::uint16_t sample) { return table[std::min<std::size_t>(sample, last)]; });
  return bytes;
}

}  // namespace

Result<PictureWish> PictureWishOf(const varlink::Json& parameters) {
  PictureWish wish;
  if (const auto* region = Given(parameters, "region")) {
    auto part = RegionOf(*region, "region");
    if (!part) return PassOn(part);
    wish.region = *part;
  }
  if (const auto* size = Given(parameters, "scaleTo")) {
    constexpr std::int64_t kMost = 1 << 20;
    const auto side = [&](const char* key) { return (*size)[key].get<std::int64_t>(); };
    if (side("widthPx") < 1 || side("heightPx") < 1) {
      return PassOn(Wrong(
          "scaleTo: widthPx and heightPx are at least 1",
          {.parameter = side("widthPx") < 1 ? "scaleTo.widthPx" : "scaleTo.heightPx", .minimum = 1.0, .unit = "px"}));
    }
    wish.scale_to = {static_cast<int>(std::min(side("widthPx"), kMost)),
                     static_cast<int>(std::min(side("heightPx"), kMost))};
  }
  if (const auto* named = Given(parameters, "encoding")) {
    const auto found = std::ranges::find(kEncodings, named->get_ref<const std::string&>());
    wish.encoding = static_cast<Encoding>(found - kEncodings.begin());
  }
  return wish;
}

FrameWindow WindowOf(const drivers::Frame& frame, const drivers::Region& region) {
  const auto [left, right] = Span(region.x, region.width, frame.width);
  const auto [top, bottom] = Span(region.y, region.height, frame.height);
  return {left, top, right - left, bottom - top};
}

std::span<const std::uint8_t> Picture::bytes() const {
  if (!lent) return written;
  return {reinterpret_cast<const std::uint8_t*>(lent->data()), lent->size() * sizeof(std::uint16_t)};
}

varlink::Json PictureJson(const Picture& picture) {
  return {{"encoding", kEncodings[static_cast<std::size_t>(picture.encoding)]},
          {"leftPx", picture.window.x},
          {"topPx", picture.window.y},
          {"widthPx", picture.width},
          {"heightPx", picture.height},
          {"channels", picture.channels},
          {"bits", picture.bits},
          {"gamma", picture.gamma}};
}

const std::vector<std::uint8_t>& PictureMaker::EightBits(int bits, double exponent) {
  if (table_.bits == bits && table_.exponent == exponent) return table_.of;
  const std::uint32_t full = (1u << bits) - 1;
  table_ = {bits, exponent, std::vector<std::uint8_t>(full + 1)};
  for (std::uint32_t sample = 0; sample <= full; ++sample) {
    const double share = std::pow(static_cast<double>(sample) / full, exponent);
    table_.of[sample] = static_cast<std::uint8_t>(std::lround(255.0 * share));
  }
  return table_.of;
}

Result<Picture> PictureMaker::Make(const drivers::Frame& frame) {
  const auto colour = frame.colour && wish_.encoding != Encoding::Gray8 ? frame.colour() : nullptr;
  if (wish_.encoding == Encoding::Rgb8 && !colour) {
    return Fail(Code::Unsupported,
                "lensd has only the luminance of this camera's pictures: ask for gray8 instead of rgb8");
  }
  const auto& whole = colour ? colour : frame.samples;
  Picture picture{wish_.encoding, WindowOf(frame, wish_.region), 0, 0, colour ? 3 : 1, frame.bits, frame.gamma, {}, {}};
  picture.width = picture.window.width;
  picture.height = picture.window.height;
  const bool all = picture.width == frame.width && picture.height == frame.height;
  const auto size = wish_.scale_to ? FitInto(*wish_.scale_to, picture.width, picture.height)
                                   : PictureWish::Size{picture.width, picture.height};
  const bool smaller = size.width < picture.width || size.height < picture.height;
  if (wish_.encoding == Encoding::Raw && all && !smaller && frame.bits > 8) {
    picture.lent = whole;
    return picture;
  }
  PixelSamples samples = Cut({*whole, picture.channels}, frame.width, picture.window);
  if (smaller) {
    samples = AveragedDown(samples, picture.width, picture.height, picture.channels, size);
    picture.width = size.width;
    picture.height = size.height;
  }
  if (wish_.encoding == Encoding::Raw) {
    picture.written = AsBytes(samples, frame.bits);
    return picture;
  }
  Result<std::vector<std::uint8_t>> written;
  if (wish_.encoding == Encoding::Png) {
    written = EncodeAsPng(picture, std::move(samples));
  } else {
    // Linear light looks black on a screen; what is measured keeps its own gamma.
    const bool for_eyes = wish_.encoding == Encoding::Jpeg;
    written = Through(EightBits(frame.bits, for_eyes ? frame.gamma / kScreenGamma : 1.0), samples);
    if (for_eyes) {
      picture.gamma = kScreenGamma;
      written = drivers::pixels::EncodeJpeg(*written, picture.width, picture.height, picture.channels, kJpegQuality);
    }
    picture.bits = 8;
  }
  if (!written) return PassOn(written);
  picture.written = *std::move(written);
  return picture;
}

LightSummary Summarise(const drivers::Frame& frame, const FrameWindow& window) {
  LightSummary light;
  light.histogram.resize(LightSummary::kBins);
  const std::int64_t count = static_cast<std::int64_t>(window.width) * window.height;
  const auto step = static_cast<int>((count + kEnoughSamples - 1) / kEnoughSamples);
  const int down = std::max(0, frame.bits - 6);
  for (int y = 0; y < window.height; y += step) {
    const auto* row = frame.samples->data() + static_cast<std::ptrdiff_t>(window.y + y) * frame.width + window.x;
    for (int x = 0; x < window.width; ++x) ++light.histogram[static_cast<std::size_t>(std::min(row[x] >> down, 63))];
  }
  const auto score = autofocus::ScoreFocus(frame, {window.x, window.y, window.width, window.height});
  if (score) {
    const double noise = autofocus::NoiseVariance({*score}, frame.bits);
    light.sharpness = autofocus::SharpnessOf(*score, noise, static_cast<int>(count)).value;
  }
  return light;
}

}  // namespace lensd::daemon
