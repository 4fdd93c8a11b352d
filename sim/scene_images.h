// The pictures a scene file names, as light and depth.
#pragma once

#include <memory>
#include <string>

#include "base/result.h"
#include "sim/scene.h"

namespace lensd::sim {

/// A grey or RGB PNG whose samples are taken as linear light; colour is kept, beside its Rec. 709 luminance.
/// Code::Io, BadData.
Result<std::shared_ptr<const Texture>> LoadTexture(const std::string& path);

/// A 16-bit grey PNG in millimetres, 0 unknown. Code::Io; BadData also where every depth is unknown.
Result<std::shared_ptr<const DepthMap>> LoadDepthMap(const std::string& path);

}  // namespace lensd::sim
