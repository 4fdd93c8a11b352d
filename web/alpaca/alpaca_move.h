// A move that a program of astronomers asked for: from its beginning to what became of it.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "web/link/lensd_link.h"

namespace lensd::web {

/// Numbers of the Alpaca API, "Error Number Values".
enum AlpacaError {
  kNone = 0,
  kNotImplemented = 0x400,
  kInvalidValue = 0x401,
  kNotConnected = 0x407,
  kInvalidOperation = 0x40B,
  kActionNotImplemented = 0x40C,
  kOperationCancelled = 0x40E,
  kDisconnected = 0x500,
  kDeviceError = 0x502
};

/// `name`: an error of io.lensd.Lens.
AlpacaError AlpacaErrorOf(std::string_view name);

struct AlpacaFailure {
  AlpacaError error = kNone;
  std::string why{};
};

/// Goes on when its maker is gone, until it is destroyed. All of it belongs to the loop's thread.
class AlpacaMove {
 public:
  /// Called once: nothing where lensd has begun it (or has not refused it within half a second), else its refusal.
  using Begun = std::function<void(const std::optional<AlpacaFailure>& refusal)>;

  /// `parameters`: of Move, to a native position.
  AlpacaMove(const LensdLink& link, varlink::Json parameters, Begun begun);
  AlpacaMove(const AlpacaMove&) = delete;
  AlpacaMove& operator=(const AlpacaMove&) = delete;
  /// Another one takes its place.
  ~AlpacaMove() { TellBegun({}); }

  bool moving() const { return call_ != nullptr; }
  /// Native position that was asked for.
  double target() const { return target_; }
  /// Native position where it ended, if it reached its target.
  const std::optional<double>& arrived_at() const { return arrived_at_; }
  /// Why it did not arrive, for as long as no client asked for anything else.
  const std::optional<AlpacaFailure>& failure() const { return failure_; }
  /// A program ends it on purpose: that it ends is no failure.
  void Halt();
  /// The failure was told, or is no longer of interest.
  void Forget() { failure_.reset(); }

 private:
  void Heard(const varlink::Reply& reply);
  void End(std::optional<AlpacaFailure> failure);
  void TellBegun(const std::optional<AlpacaFailure>& refusal);

  Begun begun_;
  const double target_;
  std::optional<double> arrived_at_;
  bool halted_ = false;
  std::optional<AlpacaFailure> failure_;
  std::unique_ptr<UpstreamCall> call_;  // until it has ended
  Watch patience_;                      // until it has begun
};

}  // namespace lensd::web
