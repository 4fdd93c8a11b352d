// One picture that is sharp everywhere, of the frames of a stack and the places of its pixels.
#pragma once

#include <vector>

#include "base/result.h"
#include "merge/depth.h"
#include "merge/picture.h"

namespace lensd::merge {

/// Takes the same frames once more, in the same order. Each pixel is mixed of the two frames next to its place, the
/// nearer one counting more, brightened to the light of the middle frame. Memory: 4 bytes a pixel and channel, and one
/// byte.
class Composer {
 public:
  /// Keeps a reference to `map`.
  Composer(std::vector<Station> stations, const DepthMap& map);

  /// InvalidArgument: another size or number of channels than the map's or the first one's, or one frame too many.
  Result<void> Add(const Picture& picture);

  /// After the last frame; once.
  Picture Finish();

 private:
  std::vector<Station> stations_;
  const DepthMap& map_;
  std::size_t added_ = 0;
  double light_ = 0.0;  ///< of the first frame, over the field that all frames share
  Picture sum_;
};

}  // namespace lensd::merge
