// Which errors of a device may pass by themselves, and how often such a call is tried before its error stands.
#pragma once

#include "base/result.h"

namespace lensd::rig {

constexpr int kAttempts = 3;  ///< in a row

constexpr bool IsTransient(Code code) {
  return code == Code::Timeout || code == Code::Protocol || code == Code::Busy;
}

}  // namespace lensd::rig
