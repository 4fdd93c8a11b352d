// Pictures in lensd's own memory, or out of base64; frames to lensd piece by piece.
#include "pictures.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "base64.h"

namespace lensd {
inline namespace v1 {
namespace {

constexpr std::size_t kPieceBytes = std::size_t{384} * 1024;  // well below the 1 MiB that a call may have

template <class T>
T Part(const Json& reply, const char* name) {
  Value value;
  Access::Put(value, Access::Own(reply));
  return Access::Get<T>(value, name);
}

std::shared_ptr<Access::PictureImpl> Begun(const Json& reply) {
  auto picture = Access::NewPicture();
  picture->info = Part<PictureInfo>(reply, "picture");
  picture->frame = Part<FrameInfo>(reply, "frame");
  picture->dropped = Part<std::optional<std::int64_t>>(reply, "dropped").value_or(0);
  picture->size = static_cast<std::size_t>(Part<std::int64_t>(reply, "size"));
  return picture;
}

/// Maps the file and closes it: the mapping alone holds the frame from then on.
void Map(int file, Access::PictureImpl& picture) {
  void* const place = mmap(nullptr, picture.size, PROT_READ, MAP_SHARED, file, 0);
  const int error = errno;
  close(file);
  if (place == MAP_FAILED) {
    throw LensdError("BrokenReply", std::string("the memory of a picture cannot be mapped: ") + std::strerror(error));
  }
  picture.mapping = place;
}

}  // namespace

std::shared_ptr<Access::PictureImpl> Access::NewPicture() {
  return std::make_shared<Access::PictureImpl>();
}

Picture Access::Wrap(std::shared_ptr<const Access::PictureImpl> picture) {
  Picture wrapped;
  wrapped.impl_ = std::move(picture);
  return wrapped;
}

const Access::FrameImpl& Access::Of(const Frame& frame) {
  return *frame.impl_;
}

Picture::Impl::~Impl() {
  if (mapping != nullptr) munmap(mapping, size);
}

const std::uint8_t* Picture::data() const {
  if (!impl_) return nullptr;
  return impl_->mapping != nullptr ? static_cast<const std::uint8_t*>(impl_->mapping) : impl_->bytes.data();
}
std::size_t Picture::size() const {
  return impl_ ? impl_->size : 0;
}
PictureInfo Picture::info() const {
  return impl_ ? impl_->info : PictureInfo();
}
FrameInfo Picture::frame() const {
  return impl_ ? impl_->frame : FrameInfo();
}
std::int64_t Picture::dropped() const {
  return impl_ ? impl_->dropped : 0;
}

Frame::Frame(const void* pixels, int width_px, int height_px) : impl_(std::make_shared<Impl>()) {
  impl_->pixels = static_cast<const std::uint8_t*>(pixels);
  impl_->width_px = width_px;
  impl_->height_px = height_px;
}
Frame& Frame::format(const std::string& pixel_format) {
  impl_->format = pixel_format;
  return *this;
}
Frame& Frame::strideBytes(std::size_t bytes) {
  impl_->stride_bytes = bytes;
  return *this;
}
Frame& Frame::gamma(double gamma) {
  impl_->gamma = gamma;
  return *this;
}
Frame& Frame::exposure(std::int64_t start_ns, std::int64_t end_ns) {
  impl_->start_ns = start_ns;
  impl_->end_ns = end_ns;
  return *this;
}

std::optional<Picture> Assembly::Add(const Json& reply, Connection& connection) {
  const bool with_file = Part<std::optional<std::int64_t>>(reply, "fd").has_value();
  const int file = with_file ? connection.TakeFile() : -1;
  if (!under_way_) {
    try {
      under_way_ = Begun(reply);
    } catch (...) {
      if (with_file) close(file);
      throw;
    }
  }
  if (with_file) {
    Map(file, *under_way_);
  } else {
    const auto offset = static_cast<std::size_t>(Part<std::int64_t>(reply, "offset"));
    if (offset != under_way_->bytes.size() || !AppendBase64(Part<std::string>(reply, "data"), under_way_->bytes)) {
      throw LensdError("BrokenReply", "a piece of a picture does not fit");
    }
    if (under_way_->bytes.size() < under_way_->size) return std::nullopt;
  }
  return Access::Wrap(std::exchange(under_way_, nullptr));
}

Json SendFrame(std::int64_t session, const Frame& frame, std::int64_t start_ns, std::int64_t end_ns,
               const CallJson& call) {
  const Access::FrameImpl& shown = Access::Of(frame);
  const std::size_t row = static_cast<std::size_t>(shown.width_px) * (shown.format == "mono8" ? 1 : 2);
  const std::size_t stride = shown.stride_bytes.value_or(row);
  const std::size_t size = shown.height_px > 0 ? stride * static_cast<std::size_t>(shown.height_px - 1) + row : 0;
  for (std::size_t offset = 0; offset < size; offset += kPieceBytes) {
    call("AutofocusPixels", {{"session", session},
                             {"offset", offset},
                             {"data", Base64(shown.pixels + offset, std::min(kPieceBytes, size - offset))}});
  }
  Json parameters{{"session", session},
                  {"widthPx", shown.width_px},
                  {"heightPx", shown.height_px},
                  {"format", shown.format},
                  {"exposureStartNs", shown.start_ns.value_or(start_ns)},
                  {"exposureEndNs", shown.end_ns.value_or(end_ns)}};
  if (shown.stride_bytes) parameters["strideBytes"] = stride;
  if (shown.gamma) parameters["gamma"] = *shown.gamma;
  return call("AutofocusFrame", std::move(parameters));
}

}  // namespace v1
}  // namespace lensd
