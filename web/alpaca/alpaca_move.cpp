// The standard wants Move() to return at once and yet to raise what keeps it from beginning; what ends it later is
// raised by IsMoving. So a request waits for the first word of lensd, which comes within milliseconds, and the end is
// remembered.
#include "web/alpaca/alpaca_move.h"

#include <utility>

namespace lensd::web {
namespace {

using varlink::Json;
constexpr Duration kBeginsWithin = std::chrono::milliseconds(500);
constexpr Duration kMoveAtMost = std::chrono::minutes(10);

/// Of a final reply. Nothing: it arrived.
std::optional<AlpacaFailure> FailureOf(const varlink::Reply& reply) {
  if (!reply.error.empty()) {
    return AlpacaFailure{AlpacaErrorOf(reply.error), reply.parameters.value("message", reply.error)};
  }
  const Json& move = reply.parameters["move"];
  if (move["reached"] == true) return std::nullopt;
  return AlpacaFailure{kDeviceError, "it came to rest elsewhere: at position " + move["position"].dump()};
}

}  // namespace

AlpacaError AlpacaErrorOf(std::string_view name) {
  name = name.substr(name.rfind('.') + 1);
  if (name == "OutOfRange" || name == "InvalidRequest") return kInvalidValue;
  if (name == "Unsupported") return kNotImplemented;
  if (name == "Cancelled" || name == "Superseded") return kOperationCancelled;
  if (name == "Disconnected" || name == "Timeout") return kDisconnected;
  return name == "DeviceError" || name == "ProtocolError" ? kDeviceError : kInvalidOperation;
}

AlpacaMove::AlpacaMove(const LensdLink& link, Json parameters, Begun begun)
    : begun_(std::move(begun)), target_(parameters["target"]["position"]) {
  call_ = link.Begin("Move", std::move(parameters), /*more=*/true, kMoveAtMost,
                     {.reply = [this](const varlink::Reply& reply, const File&) { Heard(reply); },
                      .failed = [this](const Error& why) { End(AlpacaFailure{kDisconnected, why.message}); }});
  patience_ = link.loop().After(kBeginsWithin, [this] { TellBegun({}); });
}

void AlpacaMove::Heard(const varlink::Reply& reply) {
  if (reply.continues) return TellBegun({});
  auto failure = FailureOf(reply);
  if (!failure) arrived_at_ = reply.parameters["move"]["position"].get<double>();
  End(std::move(failure));
}

void AlpacaMove::End(std::optional<AlpacaFailure> failure) {
  call_.reset();
  // What a latch refuses was never there to be ended.
  if (begun_ && failure && failure->error == kOperationCancelled) failure->error = kInvalidOperation;
  if (!halted_) failure_ = std::move(failure);
  TellBegun(failure_);
}

void AlpacaMove::Halt() {
  halted_ = true;
  failure_.reset();
}

void AlpacaMove::TellBegun(const std::optional<AlpacaFailure>& refusal) {
  patience_.reset();
  if (const Begun begun = std::exchange(begun_, nullptr)) begun(refusal);
}

}  // namespace lensd::web
