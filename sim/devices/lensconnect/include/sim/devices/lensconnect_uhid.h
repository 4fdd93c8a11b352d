// A simulated LensConnect lens plugged into this machine's kernel through /dev/uhid: hid-generic binds to it and a
// /dev/hidraw node appears.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "base/clock.h"
#include "base/result.h"
#include "sim/devices/lensconnect.h"

namespace lensd::sim::devices {

/// Answers on a thread of its own. Needs the kernel module uhid, and permission to use /dev/uhid.
class LensConnectUhid {
 public:
  LensConnectUhid(LensConnectTraits traits, std::string serial);
  ~LensConnectUhid();
  LensConnectUhid(const LensConnectUhid&) = delete;
  LensConnectUhid& operator=(const LensConnectUhid&) = delete;

  /// Plugs it in; its motors are as they were. Io: /dev/uhid refuses, with the reason.
  Result<void> Plug();
  /// Takes it out, whatever is going on.
  void Unplug();
  /// Looks at the lens, or spoils it, while no report is being answered. From any thread.
  void With(const std::function<void(LensConnect&)>& use);

 private:
  void Serve(const std::stop_token& stop);
  void Answer(const struct uhid_event& event);
  void SendInput();
  void Write(const struct uhid_event& event);

  std::string serial_;
  MonotonicClock clock_;
  std::mutex mutex_;
  LensConnect lens_;  // guarded by mutex_
  int descriptor_ = -1;
  std::jthread thread_;
};

}  // namespace lensd::sim::devices
