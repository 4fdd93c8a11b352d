// The lensd beside lens-bench, with simulated lenses of its own.
#pragma once

#include <sys/types.h>

#include <memory>
#include <string>

#include "base/result.h"

namespace lensd::bench {

/// Lives in a folder of its own; both go with this object.
class PrivateDaemon {
 public:
  /// Serves so many lenses once this returns, each of them open. Disconnected: lensd is not beside lens-bench, or does
  /// not begin.
  static Result<std::unique_ptr<PrivateDaemon>> Start(int lenses);
  PrivateDaemon(const PrivateDaemon&) = delete;
  PrivateDaemon& operator=(const PrivateDaemon&) = delete;
  ~PrivateDaemon();
  std::string socket() const { return folder_ + "/s"; }

 private:
  PrivateDaemon();
  void WriteConfiguration(int lenses) const;
  bool Ready() const;

  std::string folder_;
  pid_t process_ = -1;
};

}  // namespace lensd::bench
