// Pictures of a lens as they come, shared by everybody who looks at the same.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "varlink/json.h"
#include "web/exchange.h"
#include "web/link/lensd_link.h"

namespace lensd::web {

class LiveView;

/// What is looked at: two that are equal share one View of lensd.
struct ViewKey {
  std::string lens;                ///< empty: the only one
  std::string encoding;            ///< jpeg, png, raw, gray8, rgb8
  varlink::Json scale_to, region;  ///< as in View, or null
  double rate_hz = 0;
  bool operator<(const ViewKey& other) const;
};

/// Reads `lens width height rate encoding x y w h` of the query. Code::InvalidArgument: what is wrong with them.
Result<ViewKey> ReadViewKey(const Exchange& exchange);

/// Every View that is open. A view closes when the last one who looks is gone.
class LiveViews {
 public:
  explicit LiveViews(const LensdLink& link) : link_(link) {}
  /// Answers with multipart/x-mixed-replace once there is a picture, else with the error that tells why there is none.
  void Show(Exchange& exchange, const ViewKey& key);

  std::size_t open() const;
  std::uint64_t frames = 0;   ///< that came from lensd
  std::uint64_t dropped = 0;  ///< that some viewer was too slow for

 private:
  const LensdLink& link_;
  std::map<ViewKey, std::weak_ptr<LiveView>> views_;
};

}  // namespace lensd::web
