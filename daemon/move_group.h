// Several motions that are answered together.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "proto/json.h"
#include "worker.h"

namespace lensd::daemon {

/// Waits for all of its motions; the first error among them is the answer. Made anywhere, then used on the worker's
/// thread only; `ended` runs in the event loop.
class MoveGroup : public std::enable_shared_from_this<MoveGroup> {
 public:
  MoveGroup(Worker& worker, std::string lens) : worker_(worker), lens_(std::move(lens)) {}

  void OnEnd(std::function<void(const MoveGroup&)> ended) { ended_ = std::move(ended); }
  /// The callback for one more motion.
  rig::MoveCallback Add();
  /// All motions are added.
  void Complete() { EndOne(); }
  /// Ends the group before any motion was added.
  void Fail(Error error);

  const proto::Json& moves() const { return moves_; }
  const std::vector<rig::MoveOutcome>& outcomes() const { return outcomes_; }
  const std::optional<Error>& error() const { return error_; }

 private:
  void EndOne();

  Worker& worker_;
  std::string lens_;
  std::function<void(const MoveGroup&)> ended_;
  int outstanding_ = 1;  // Complete() is one
  proto::Json moves_ = proto::Json::array();
  std::vector<rig::MoveOutcome> outcomes_;
  std::optional<Error> error_;
};

}  // namespace lensd::daemon
