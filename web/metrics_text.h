// The metrics of lensd and lens-web as Prometheus reads them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "varlink/json.h"

namespace lensd::web {

/// What lens-web counts of itself.
struct OwnMetrics {
  std::size_t connections = 0, streams = 0, views = 0;
  std::uint64_t frames = 0, frames_dropped = 0;
};

/// Text exposition format 0.0.4. `status` and `metrics` are the replies of these methods; null: lensd does not answer.
std::string MetricsText(const varlink::Json& status, const varlink::Json& metrics, const OwnMetrics& own);

}  // namespace lensd::web
