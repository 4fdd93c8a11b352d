// What lensd has learned of a lens' blur from its autofocus runs, which the next ones go by.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "rig/learned_slope.h"
#include "rig/rig.h"
#include "varlink/json.h"

namespace lensd::daemon {

class ServedLens;

/// What was learned, for any thread.
class SharedSlope {
 public:
  std::shared_ptr<const rig::LearnedSlope> Get() const {
    const std::lock_guard lock(mutex_);
    return learned_;
  }
  void Put(rig::LearnedSlope learned) {
    auto next = std::make_shared<const rig::LearnedSlope>(std::move(learned));
    const std::lock_guard lock(mutex_);
    learned_.swap(next);
  }

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const rig::LearnedSlope> learned_ = std::make_shared<const rig::LearnedSlope>();  ///< never null
};

/// Of one lens. Event loop thread only.
class LensSlope {
 public:
  explicit LensSlope(ServedLens& lens) : lens_(lens) {}

  /// The lens was opened (anew): with what `file` holds, or why that cannot be read, and so is not written over.
  void Opened(Result<std::vector<rig::SlopeRun>> learned, std::string file);
  /// For a search, which looks when it begins, on any thread, also where it begins anew later. Null: the configuration
  /// does not let searches go by it.
  rig::KnownSlopes ForSearches() const;
  /// By how many frames pictures are late, for searches, which note what they see of it. In memory alone.
  const std::shared_ptr<rig::LearnedLag>& lags() const { return lags_; }
  /// An array of LearnedLag of the interface.
  varlink::Json LagsJson() const;
  /// A search has ended.
  void Found(const rig::AutofocusOutcome& outcome);
  /// LearnedState of the interface. `now`: as the lens stands; nothing: an axis is not homed.
  varlink::Json StateJson(const std::optional<rig::SlopeConditions>& now, const rig::OpticsTable* optics) const;
  /// NotKept.
  void Forget(const std::function<void(const Result<void>&)>& done);

 private:
  void Put(rig::LearnedSlope learned, const std::function<void(const Result<void>&)>& then);

  ServedLens& lens_;
  std::shared_ptr<SharedSlope> learned_ = std::make_shared<SharedSlope>();
  std::shared_ptr<rig::LearnedLag> lags_ = std::make_shared<rig::LearnedLag>();
  std::string file_{};  ///< empty: nowhere
  std::optional<Error> unreadable_{};
};

/// AutofocusSlope of the interface; null where the search neither knew nor showed any.
varlink::Json AutofocusSlopeJson(const rig::AutofocusOutcome& outcome);

}  // namespace lensd::daemon
