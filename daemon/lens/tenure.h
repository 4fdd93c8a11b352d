// One opening of a lens, and whether it still counts.
#pragma once

#include <atomic>

#include "base/clock.h"
#include "drivers/api/device.h"

#include <memory>

namespace lensd::daemon {

/// Shared by the thread that opens a device, the worker that comes of it, and the event loop, which ends it. Any
/// thread.
class Tenure {
 public:
  /// From now on nothing that was done under it reaches the device, the disk or a client. False: it was over before.
  bool End() { return !over_.exchange(true); }
  bool over() const { return over_; }

  /// An attempt to open the device begins or ends.
  void OpeningSince(Instant now) { opening_since_ = now.time_since_epoch().count(); }
  void NotOpening() { opening_since_ = 0; }
  /// For how long the attempt under way has lasted; zero: there is none.
  Duration OpeningFor(Instant now) const {
    const Instant since{Duration(opening_since_.load())};
    return since == Instant{} ? Duration::zero() : now - since;
  }

 private:
  std::atomic<bool> over_ = false;
  std::atomic<Duration::rep> opening_since_ = 0;
};

/// The same device for as long as `tenure` lasts; after that its calls return Cancelled, but for those in progress.
drivers::Device Under(std::shared_ptr<const Tenure> tenure, drivers::Device device);

}  // namespace lensd::daemon
