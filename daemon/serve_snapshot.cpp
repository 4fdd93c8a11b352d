// Snapshot: one frame as a PNG, compressed on a thread of its own and sent piece by piece as the client reads.
#include <algorithm>
#include <memory>
#include <span>
#include <utility>

#include "io/png.h"
#include "lens_json.h"
#include "lens_service.h"
#include "proto/interfaces.h"
#include "serve.h"
#include "task_thread.h"
#include "varlink/base64.h"

namespace lensd::daemon {
namespace {

using varlink::Json;

/// 512 KiB of base64: half a message.
constexpr std::size_t kPieceBytes = std::size_t{384} << 10;

/// PNG knows 8 and 16 bits: others are scaled to the full range of 16.
Result<std::vector<std::uint8_t>> EncodeFrame(const drivers::Frame& frame) {
  const int channels = frame.colour ? 3 : 1;
  const auto& samples = frame.colour ? *frame.colour : *frame.samples;
  io::Image image{frame.width, frame.height, channels, frame.bits == 8 ? 8 : 16, samples};
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
    Json piece{{"png", varlink::EncodeBase64(std::span(png).subspan(offset, count))},
               {"offset", offset},
               {"size", png.size()}};
    if (offset == 0) piece["frame"] = frame;
    offset += count;
    return piece;
  }
  bool AtEnd() const { return offset == png.size(); }
};

void SendPiece(const ExchangePointer& exchange, const std::shared_ptr<Transfer>& transfer) {
  const std::string piece = varlink::WriteJson(transfer->NextPiece());
  if (transfer->AtEnd()) return exchange->Finish(piece);
  exchange->Continue(piece);
}

/// A frame on its way to the client. `pictures` compresses it.
void StreamFrame(TaskThread& pictures, EventLoop& loop, const ExchangePointer& exchange,
                 const rig::LensedFrame& frame) {
  const bool taken = pictures.Submit([&loop, exchange, frame] {
    auto png = EncodeFrame(frame.frame);
    loop.Post([exchange, frame, png = std::move(png)]() mutable {
      if (!png) return Refuse(exchange, png.error());
      auto transfer = std::make_shared<Transfer>(*std::move(png), FrameJson(frame));
      exchange->OnDrained([raw = exchange.get(), transfer] {
        if (!transfer->AtEnd()) SendPiece(raw->shared_from_this(), transfer);
      });
      SendPiece(exchange, transfer);
    });
  });
  if (!taken) Refuse(exchange, {Code::Busy, "too many pictures wait to be compressed; try again"});
}

void Snapshot(LensService& service, TaskThread& pictures, const ExchangePointer& exchange) {
  ServedLens* const lens = service.FindPresent(exchange);
  if (lens == nullptr) return;
  const Json* wish = Given(exchange->parameters(), "inMotion");
  const auto frames = wish != nullptr && wish->get<bool>() ? rig::LensMotion::Any : rig::LensMotion::Standing;
  const auto shoot = [frames](rig::Rig& rig, rig::SnapshotCallback done) { rig.Snapshot(std::move(done), frames); };
  lens->Ask<rig::LensedFrame>(shoot, [&service, &pictures, exchange](const Result<rig::LensedFrame>& frame) {
    if (!frame) return Refuse(exchange, frame.error());
    StreamFrame(pictures, service.loop(), exchange, *frame);
  });
}

}  // namespace

MethodTable SnapshotMethods(LensService& service) {
  const auto pictures = std::make_shared<TaskThread>();
  return {{"Snapshot", service.ForPresent([&service, pictures](const ExchangePointer& exchange) {
             Snapshot(service, *pictures, exchange);
           }),
           NeedsLease::No, MayChangeState::No, Acts::InTurn, Streams::Only}};
}

}  // namespace lensd::daemon
