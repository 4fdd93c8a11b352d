// Focus measures as others write them.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "autofocus/measures.h"

namespace lensd::bench {

struct MeasurePeer {
  std::string name;
  std::string measure;  ///< which of ours it stands against
  std::function<double(autofocus::GreyView<std::uint8_t>)> run;
};

/// Empty where OpenCV was not there at build time.
std::vector<MeasurePeer> MeasurePeers();

}  // namespace lensd::bench
