// What a client gets of a frame: a part of it, smaller, in the encoding it asked for; and what can be said of its
// light.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "drivers/api/camera.h"
#include "varlink/json.h"

namespace lensd::daemon {

/// How a picture is written; see Encoding of the interface.
enum class Encoding { Png, Jpeg, Raw, Gray8, Rgb8 };

/// What a client wants of every frame.
struct PictureWish {
  struct Size {
    int width = 0;   ///< px
    int height = 0;  ///< px
  };
  drivers::Region region{0.0, 0.0, 1.0, 1.0};
  std::optional<Size> scale_to;  ///< it fits into this and keeps its shape; never enlarged
  Encoding encoding = Encoding::Png;
};

/// A Region of a call, which has it at `path`. InvalidArgument: outside the frame.
Result<drivers::Region> RegionOf(const varlink::Json& region, const std::string& path);
/// `region`, `scaleTo` and `encoding` of a call. InvalidArgument: a region outside the frame, a size below 1 px.
Result<PictureWish> PictureWishOf(const varlink::Json& parameters);

/// A part of a frame, in whole pixels of it.
struct FrameWindow {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};
/// At least one pixel of it.
FrameWindow WindowOf(const drivers::Frame& frame, const drivers::Region& region);

/// One picture, written.
struct Picture {
  Encoding encoding = Encoding::Png;
  FrameWindow window;  ///< what it shows of the frame
  int width = 0;       ///< px
  int height = 0;      ///< px
  int channels = 1;    ///< 1: luminance; 3: red, green, blue
  int bits = 8;        ///< significant bits a sample
  double gamma = 1.0;  ///< sample = light^(1/gamma)
  /// The file or the samples; they live as long as this.
  std::span<const std::uint8_t> bytes() const;

  std::vector<std::uint8_t> written;
  std::shared_ptr<const std::vector<std::uint16_t>> lent;  ///< of the frame itself, where nothing had to be done
};

/// PictureInfo of the interface, without what is of the light.
varlink::Json PictureJson(const Picture& picture);

/// Makes pictures of one wish. One thread at a time.
class PictureMaker {
 public:
  explicit PictureMaker(PictureWish wish) : wish_(wish) {}
  const PictureWish& wish() const { return wish_; }
  /// Unsupported: colour of a camera that has none. InvalidArgument: too large for its encoding.
  Result<Picture> Make(const drivers::Frame& frame);

 private:
  /// From a sample to 8 bits; `gamma` 1 keeps the sample's own.
  const std::vector<std::uint8_t>& EightBits(int bits, double exponent);

  PictureWish wish_;
  struct Table {
    int bits = 0;
    double exponent = 0.0;
    std::vector<std::uint8_t> of;
  };
  Table table_;  ///< of the frame before
};

/// The light of a window of a frame's luminance.
struct LightSummary {
  static constexpr int kBins = 64;
  std::vector<std::uint32_t> histogram;  ///< samples by value, kBins equal parts of the full scale
  /// Gradient energy without noise over squared mean; nothing: too few pixels.
  std::optional<double> sharpness;
};
/// Of every row, or of every second, third ... where the window has more than a million samples.
LightSummary Summarise(const drivers::Frame& frame, const FrameWindow& window);

}  // namespace lensd::daemon
