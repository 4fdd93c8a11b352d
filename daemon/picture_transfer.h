// A picture on its way out in pieces, none of which makes a message too long.
#pragma once

#include <algorithm>
#include <deque>
#include <string>
#include <utility>

#include "picture.h"
#include "varlink/base64.h"
#include "varlink/json.h"

namespace lensd::daemon {

/// The replies that carry a picture as base64, in order, ready to be sent; the first has the fields of `about` too.
inline std::deque<std::string> PiecesOf(const Picture& picture, varlink::Json about) {
  constexpr std::size_t kPieceBytes = std::size_t{384} << 10;  // 512 KiB of base64: half a message
  const auto bytes = picture.bytes();
  std::deque<std::string> pieces;
  for (std::size_t at = 0; at < bytes.size(); at += kPieceBytes) {
    varlink::Json piece = std::exchange(about, varlink::Json::object());
    piece["data"] = varlink::EncodeBase64(bytes.subspan(at, std::min(kPieceBytes, bytes.size() - at)));
    piece["offset"] = at;
    piece["size"] = bytes.size();
    pieces.push_back(varlink::WriteJson(piece));
  }
  return pieces;
}

}  // namespace lensd::daemon
