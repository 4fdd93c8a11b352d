// One lensd, from its start to its end or its kill.
#pragma once

#include <memory>
#include <string>
#include <thread>

#include "base/clock.h"
#include "true_lenses.h"

namespace lensd::year {

/// The daemon as main() puts it together, on a thread of its own. One that was killed is never destroyed.
class Life {
 public:
  Life(Lenses& lenses, const std::string& state, int listening);
  /// Told to end as by SIGTERM; waits for its end.
  ~Life();
  Life(const Life&) = delete;
  Life& operator=(const Life&) = delete;
  bool ended() const;

 private:
  struct Parts;
  const std::shared_ptr<Parts> parts_;
  std::thread thread_;
};

}  // namespace lensd::year
