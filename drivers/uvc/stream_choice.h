// Which picture to ask a camera for, and how to agree on it.
#pragma once

#include <cstdint>

#include "config.h"
#include "descriptors.h"
#include "session.h"

namespace lensd::drivers::uvc {

/// One offer of a camera.
struct StreamChoice {
  std::uint8_t interface = 0;
  std::uint8_t format_index = 0;
  std::uint8_t frame_index = 0;
  PixelFormat pixels = PixelFormat::Yuyv;
  std::uint8_t transfer_characteristics = 0;
  int width = 0;               ///< px
  int height = 0;              ///< px
  std::uint32_t interval = 0;  ///< 100 ns
};

/// The offer that fits the configuration. Size: the one asked for, or the camera's default. Format: the one asked for,
/// or YUYV where that is fast enough (the rate asked for, or 15 a second), otherwise MJPEG. Of several streaming
/// interfaces the first that has it. Unsupported: there is none; the message lists what there is.
Result<StreamChoice> Choose(const VideoFunction& function, const CameraConfig& config);

/// Agrees on `choice` with the camera (probe and commit, UVC 1.1 section 4.3.1.1) and says where its pictures come
/// from. Unsupported: no alternate setting is wide enough, or the camera wants something else. Errors as
/// Controls::Set().
Result<StreamPipe> Negotiate(Session& session, const StreamChoice& choice);

}  // namespace lensd::drivers::uvc
