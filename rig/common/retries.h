// Which errors of a device may pass by themselves, and how often such a call is tried before its error stands.
#pragma once

#include <utility>

#include "base/clock.h"
#include "base/result.h"

namespace lensd::rig {

constexpr int kAttempts = 3;  ///< in a row
/// A device that says that it is busy has heard, and is asked again by time instead: for so long.
constexpr Duration kBusyPatience = std::chrono::seconds(5);

/// A command that is answered by what is no answer to it, or by a refusal without a reason, is sent again for so long.
constexpr Duration kBrokenPatience = std::chrono::seconds(1);

constexpr bool IsTransient(Code code) {
  return code == Code::Timeout || code == Code::Protocol || code == Code::Busy;
}

constexpr Duration kBusyAgain = std::chrono::milliseconds(10);  ///< and not sooner than after that
/// `error` as it is passed on after kBusyPatience: nothing else that lensd does keeps the device busy.
inline Error StillBusy(Error error) {
  if (error.code == Code::Busy) error = {Code::Timeout, std::move(error.message) + ", and that for 5 s"};
  return error;
}

}  // namespace lensd::rig
