// Snapshot: one frame as a PNG, compressed on a thread of its own and sent piece by piece as the client reads.
#include <algorithm>
#include <memory>
#include <span>
#include <utility>

#include "io/png.h"
#include "lens_entry.h"
#include "lens_json.h"
#include "lens_service.h"
#include "proto/base64.h"
#include "proto/interfaces.h"

namespace lensd::daemon {
namespace {

using proto::Json;

/// 512 KiB of base64: half a message.
constexpr std::size_t kPieceBytes = std::size_t{384} << 10;

/// PNG knows 8 and 16 bits: others are scaled to the full range of 16.
Result<std::vector<std::uint8_t>> EncodeFrame(const drivers::Frame& frame) {
  io::Image image{frame.width, frame.height, 1, frame.bits == 8 ? 8 : 16, *frame.samples};
  if (frame.bits != 8 && frame.bits != 16) {
    const std::uint32_t full = (1u << frame.bits) - 1;
    for (std::uint16_t& sample : image.samples) {
      sample = static_cast<std::uint16_t>((std::min<std::uint32_t>(sample, full) * 65535u + full / 2) / full);
    }
  }
  return io::EncodePng(image);
}

/// A file on its way out.
struct Transfer {
  std::vector<std::uint8_t> png;
  Json frame;
  std::size_t offset = 0;

  Json NextPiece() {
    const std::size_t count = std::min(kPieceBytes, png.size() - offset);
    Json piece{
        {"png", proto::EncodeBase64(std::span(png).subspan(offset, count))}, {"offset", offset}, {"size", png.size()}};
    if (offset == 0) piece["frame"] = frame;
    offset += count;
    return piece;
  }
  bool AtEnd() const { return offset == png.size(); }
};

void SendPiece(const ExchangePointer& exchange, const std::shared_ptr<Transfer>& transfer) {
  const std::string piece = proto::WriteJson(transfer->NextPiece());
  if (transfer->AtEnd()) return exchange->Finish(piece);
  exchange->Continue(piece);
}

}  // namespace

void LensService::Snapshot(const ExchangePointer& exchange) {
  Lens* const lens = FindLens(exchange);
  if (lens == nullptr) return;
  if (!exchange->call().more) return exchange->Refuse(proto::kExpectedMore, Json::object());
  auto answer = [this, exchange](const Result<rig::LensedFrame>& frame) {
    if (!frame) return Refuse(exchange, frame.error());
    StreamFrame(exchange, *frame);
  };
  lens->worker->Submit([lens, answer](rig::Rig& rig) {
    rig.Snapshot([lens, answer](Result<rig::LensedFrame> frame) {
      lens->worker->Later([answer, frame = std::move(frame)] { answer(frame); });
    });
  });
}

void LensService::StreamFrame(const ExchangePointer& exchange, const rig::LensedFrame& frame) {
  pictures_.Submit([this, exchange, frame] {
    auto png = EncodeFrame(frame.frame);
    loop_.Post([this, exchange, frame, png = std::move(png)]() mutable {
      if (!png) return Refuse(exchange, png.error());
      auto transfer = std::make_shared<Transfer>(*std::move(png), FrameJson(frame));
      exchange->OnDrained([raw = exchange.get(), transfer] {
        if (!transfer->AtEnd()) SendPiece(raw->shared_from_this(), transfer);
      });
      SendPiece(exchange, transfer);
    });
  });
}

}  // namespace lensd::daemon
