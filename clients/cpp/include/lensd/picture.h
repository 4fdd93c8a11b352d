// Pictures that come from lensd, and frames that go there.
#ifndef LENSD_PICTURE_H_
#define LENSD_PICTURE_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "lensd/types.h"

namespace lensd {
inline namespace v1 {

/// A picture; made by default it is none, and data() null. Cheap to copy: copies share its memory, which of a View is
/// lensd's own and goes back with the last copy. lensd has three pictures of a view out at a time: those that are kept
/// longer hold up the view.
class LENSD_API Picture {
 public:
  /// Row after row without gaps (raw, gray8, rgb8), or the bytes of a file (png, jpeg). Read only; valid as long as a
  /// copy lives.
  const std::uint8_t* data() const;
  std::size_t size() const;
  /// How it is written, and how large it is.
  PictureInfo info() const;
  /// When it was exposed, and where every axis was meanwhile.
  FrameInfo frame() const;
  /// Frames that the view has dropped since it began.
  std::int64_t dropped() const;

 private:
  friend struct Access;
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

/// A frame of the caller's own camera, for Client::Autofocus. Its pixels are the caller's: they stay where they are
/// until the function that gave the frame is called again or the search has ended.
class LENSD_API Frame {
 public:
  /// Rows of `width_px` samples of one byte (mono8), or of two with format("mono16le") and the like, without gaps.
  /// Without exposure times it was exposed while the function ran that gives it; sample = light^(1/gamma), 1 when left
  /// out.
  Frame(const void* pixels, int width_px, int height_px);
  Frame& format(const std::string& pixel_format);
  Frame& strideBytes(std::size_t bytes);
  Frame& gamma(double gamma);
  /// On CLOCK_MONOTONIC.
  Frame& exposure(std::int64_t start_ns, std::int64_t end_ns);

 private:
  friend struct Access;
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace v1
}  // namespace lensd

#endif
