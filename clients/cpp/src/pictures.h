// What Pictures and Frames share, and how pictures are put together out of replies.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "connection.h"

namespace lensd {
inline namespace v1 {

struct Picture::Impl {
  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl();

  PictureInfo info;
  FrameInfo frame;
  std::int64_t dropped = 0;
  void* mapping = nullptr;            // lensd's memory, or
  std::vector<std::uint8_t> bytes{};  // what came as base64
  std::size_t size = 0;
};

struct Frame::Impl {
  const std::uint8_t* pixels = nullptr;
  std::int64_t width_px = 0, height_px = 0;
  std::string format = "mono8";
  std::optional<std::size_t> stride_bytes{};
  std::optional<double> gamma{};
  std::optional<std::int64_t> start_ns{}, end_ns{};
};

/// Puts pictures together: of pieces of base64, or of one file each.
class Assembly {
 public:
  /// The picture that this reply of Snapshot or View completes. Takes its file from the connection.
  std::optional<Picture> Add(const Json& reply, Connection& connection);

 private:
  std::shared_ptr<Access::PictureImpl> under_way_;
};

/// Sends a frame that was exposed between these times, in pieces, by `call`; gives what the last one is answered with.
using CallJson = std::function<Json(const char* method, Json parameters)>;
Json SendFrame(std::int64_t session, const Frame& frame, std::int64_t start_ns, std::int64_t end_ns,
               const CallJson& call);

}  // namespace v1
}  // namespace lensd
