// What lensd does by itself to keep a lens in focus ([lens.refocus]): from what the lens tells to its worker, to a file
// and to those who watch.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "rig/refocus.h"
#include "varlink/json.h"

namespace lensd::daemon {

class ServedLens;

/// Of one lens. Event loop thread only.
class LensRefocus {
 public:
  explicit LensRefocus(ServedLens& lens) : lens_(lens) {}

  /// The lens was opened (anew): with what was learned of it, or why that cannot be read, and so is not written over.
  void Opened(Result<std::vector<rig::DriftSample>> learned);
  /// An autofocus has ended that a client asked for.
  void Found(const rig::AutofocusRequest& request, const rig::AutofocusOutcome& outcome);
  /// The lens' state is new.
  void Look();
  /// RefocusState of the interface.
  varlink::Json StateJson() const;
  /// The result of this number, from 1, or all. InvalidArgument: there is no such result. NotKept.
  void Forget(std::optional<std::int64_t> sample, const std::function<void(const Result<void>&)>& done);

 private:
  std::string WhyWait() const;
  void Watch();
  void Ended(rig::RefocusCause cause, const Result<rig::RefocusOutcome>& outcome);
  void Tell(rig::RefocusCause cause, const Result<rig::RefocusOutcome>& outcome);
  void Keep(const std::function<void(const Result<void>&)>& then);

  ServedLens& lens_;
  std::optional<rig::RefocusKeeper> keeper_{};  ///< where it is configured and the lens was there
  std::optional<Error> unreadable_{};
  varlink::Json last_ = nullptr;
  bool under_way_ = false;
};

}  // namespace lensd::daemon
