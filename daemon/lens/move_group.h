// Several motions that are answered together.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "rig/rig.h"
#include "varlink/json.h"

namespace lensd::daemon {

/// In the order in which they ended.
using Moves = std::vector<rig::MoveOutcome>;
using MovesCallback = std::move_only_function<void(Result<Moves>)>;

/// Waits for all of its motions; the first error among them is the answer. The rig's thread only.
class MoveGroup : public std::enable_shared_from_this<MoveGroup> {
 public:
  explicit MoveGroup(MovesCallback done) : done_(std::move(done)) {}

  /// The callback for one more motion.
  rig::MoveCallback Add();
  /// All motions are added.
  void Complete() { EndOne(); }

 private:
  void EndOne();

  MovesCallback done_;
  int outstanding_ = 1;  // Complete() is one
  Result<Moves> moves_;
};

/// Homes one axis, or every axis that has a reference. The rig's thread only.
void HomeAxes(rig::Rig& rig, std::optional<drivers::Axis> only, MovesCallback done);

/// []MoveResult.
varlink::Json MovesJson(const std::string& lens, const Moves& moves);

}  // namespace lensd::daemon
