// A calibration that is in force and not on disk yet, for a lens that is opened anew meanwhile.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "rig/calibration.h"

namespace lensd::daemon {

/// From any thread: a lens is opened on a thread of its own.
class UnwrittenCalibration {
 public:
  struct Content {
    std::string file;                                       ///< where it belongs
    std::shared_ptr<const rig::Calibration> calibration{};  ///< null: the file is to be removed
  };
  void Put(std::optional<Content> content) {
    const std::lock_guard lock(mutex_);
    content_ = std::move(content);
  }
  std::optional<Content> Get() const {
    const std::lock_guard lock(mutex_);
    return content_;
  }

 private:
  mutable std::mutex mutex_;
  std::optional<Content> content_;
};

}  // namespace lensd::daemon
