// Messages are cut at NUL bytes. What was searched is not searched again, so a message that comes byte by byte costs no
// more than one that comes whole.
#include "varlink/frame.h"

#include <algorithm>

namespace lensd::varlink {

void FrameReader::Append(std::string_view bytes) {
  buffer_.erase(0, start_);
  scanned_ -= start_;
  start_ = 0;
  buffer_.append(bytes);
}

Result<std::optional<std::string_view>> FrameReader::Next() {
  const std::size_t end = buffer_.find('\0', scanned_);
  scanned_ = std::min(end, buffer_.size());
  if (scanned_ - start_ > longest_) {
    return Fail(Code::Protocol, "a message longer than " + std::to_string(longest_ >> 20) + " MiB");
  }
  if (end == std::string::npos) return std::nullopt;
  const std::string_view message = std::string_view(buffer_).substr(start_, end - start_);
  start_ = scanned_ = end + 1;
  return message;
}

}  // namespace lensd::varlink
