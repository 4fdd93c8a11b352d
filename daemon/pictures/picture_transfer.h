// A picture on its way out in pieces, none of which makes a message too long.
#pragma once

#include <algorithm>
#include <deque>
#include <memory>
#include <string>
#include <utility>

#include "daemon/pictures/picture.h"
#include "daemon/server/exchange.h"
#include "varlink/base64.h"
#include "varlink/json.h"

namespace lensd::daemon {

/// How the pieces of a picture are written.
struct PieceForm {
  const char* field = "data";                       ///< that carries them
  std::size_t most_bytes = std::size_t{384} << 10;  ///< 512 KiB of base64: half a message
};

/// The replies that carry a picture as base64, in order, ready to be sent; the first has the fields of `about` too.
inline std::deque<std::string> PiecesOf(const Picture& picture, varlink::Json about, PieceForm form = {}) {
  const auto bytes = picture.bytes();
  std::deque<std::string> pieces;
  for (std::size_t at = 0; at < bytes.size(); at += form.most_bytes) {
    varlink::Json piece = std::exchange(about, varlink::Json::object());
    piece[form.field] = varlink::EncodeBase64(bytes.subspan(at, std::min(form.most_bytes, bytes.size() - at)));
    piece["offset"] = at;
    piece["size"] = bytes.size();
    pieces.push_back(varlink::WriteJson(piece));
  }
  return pieces;
}

/// The last replies of a call: each piece once the one before has been read.
inline void SendPieces(const ExchangePointer& exchange, std::deque<std::string> all) {
  const auto send = [raw = exchange.get(), pieces = std::make_shared<std::deque<std::string>>(std::move(all))] {
    if (pieces->empty()) return;
    const std::string piece = std::move(pieces->front());
    pieces->pop_front();
    pieces->empty() ? raw->Finish(piece) : raw->Continue(piece);
  };
  exchange->OnDrained(send);
  send();
}

}  // namespace lensd::daemon
