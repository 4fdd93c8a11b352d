// Where each pixel of a stack is sharp: its place by the frames' sharpness around the sharpest one.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "base/result.h"
#include "merge/picture.h"

namespace lensd::merge {

/// Which of two places a pixel gets that is sharp at both, as at the rim of a thing before another.
enum class Prefer {
  Sharper,
  Later,  ///< of the frame that comes later in the stack: the near one where places rise toward near
};

/// Places of pixels. NaN: nothing is known, because nothing there rose above the frames' own noise, or because it is
/// beside something nearer (places rise toward near).
struct DepthMap {
  int width = 0;
  int height = 0;
  std::vector<float> place;       ///< in the unit of Station::place
  std::vector<float> sigma;       ///< standard deviation of it; NaN with it
  std::vector<float> confidence;  ///< share of the sharpness at the peak that neither noise nor other frames have; 0..1
  std::vector<float>
      everywhere;      ///< for the picture: rims of near things too, and what is around where nothing is known
  double known = 0.0;  ///< share of pixels whose place is known
};

struct PeakSamples;

/// Takes the frames of a stack one after the other and keeps none. Memory: 26 bytes a pixel while frames come (40 with
/// Prefer::Later), whatever their number, and as much again for the frame that is being looked at.
class DepthFinder {
 public:
  /// InvalidArgument: fewer than two stations, places out of order, a scale not above 0.
  static Result<DepthFinder> Create(std::vector<Station> stations, Prefer prefer = Prefer::Sharper);
  DepthFinder(DepthFinder&&) noexcept;
  DepthFinder& operator=(DepthFinder&&) noexcept;
  ~DepthFinder();

  /// The frame of the next station. InvalidArgument: another size than the first one's, or one too many.
  Result<void> Add(const Picture& picture);

  /// After the last frame; once. InvalidArgument: frames are missing.
  Result<DepthMap> Finish();

 private:
  /// Sharpness around one maximum of each pixel, along the stack; < 0 where the stack ends.
  struct Peaks {
    std::vector<float> before, at, after;
    std::vector<std::uint16_t> index;
  };
  struct Learned;
  DepthFinder(std::vector<Station> stations, Prefer prefer);
  void Follow(std::vector<float> sharpness, const std::vector<float>& light);
  void FollowLater(const std::vector<float>& sharpness);
  PeakSamples SamplesOf(const Peaks& peaks, std::size_t pixel) const;
  double UsualBend() const;
  void Locate(DepthMap& map) const;

  std::vector<Station> stations_;
  Prefer prefer_;
  int width_ = 0, height_ = 0;
  std::uint16_t added_ = 0;
  double light_of_first_ = 0.0;
  Peaks best_, later_;
  std::vector<float> last_;   ///< sharpness of the frame before
  std::vector<float> least_;  ///< of any frame
  std::vector<float> light_;  ///< of the sharpest frame
  std::unique_ptr<Learned> learned_;
};

}  // namespace lensd::merge
