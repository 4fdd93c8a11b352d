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

/// A PNG as the camera is to give it. BadData: not of the camera's size, grey where it has colour or the other way
/// round, not 8 bits where it has 8 and 16 where it has more, or a sample beyond its bits. Code::Io.
Result<PreparedFrame> LoadPreparedFrame(const std::string& path, const CameraSettings& camera);

}  // namespace lensd::sim
