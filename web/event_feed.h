// What happens to the lenses, told to every page by one Monitor of lensd, and what happened in the last hour.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "varlink/json.h"
#include "web/exchange.h"
#include "web/link/lensd_link.h"

namespace lensd::web {

class Subscriber;

/// One event with the number lens-web gave it.
struct FeedEntry {
  std::uint64_t number = 0;
  std::string lens;  ///< empty: of lensd itself, told to everybody
  std::string text;  ///< as server-sent events have it
};

/// Connects by itself, again and again with longer pauses, to 30 s. Event loop thread only.
class EventFeed {
 public:
  explicit EventFeed(const LensdLink& link);
  ~EventFeed();

  /// Answers with text/event-stream: how things stand, then what happens; `lens` empty: to all of them. With the header
  /// Last-Event-ID it goes on behind that event, and tells as `event: gap` what it can no longer tell.
  void Subscribe(Exchange& exchange, const std::string& lens);
  /// {"events": [{"atMs", "event"}]}: what is lasting in Monitor, of the last hour, 2000 at most, without samples.
  varlink::Json History();
  /// Empty while lensd answers, else why it does not.
  const std::string& down() const { return down_; }

 private:
  friend class Subscriber;
  struct Past {
    std::chrono::system_clock::time_point at;
    varlink::Json event;
  };
  /// What was told of a lens last: its state, and the numbers of what happened since.
  struct Newest {
    varlink::Json state;  ///< an event with `status`; null before the first
    std::int64_t sequence = 0, lasting = 0;
  };
  void Connect();
  void Follow();
  void Greet(const varlink::Reply& list);
  void Retry(const std::string& why);
  void Take(const varlink::Reply& reply);
  void Remember(const varlink::Json& event);
  void ForgetOne();
  void Append(std::string lens, std::string text);
  void TellDaemon();
  void Count(const std::string& lens, const varlink::Json& event);

  const LensdLink& link_;
  std::unique_ptr<UpstreamCall> call_;
  Watch again_;
  std::chrono::milliseconds pause_{0};
  std::string down_ = "not connected yet";
  std::string instance_;                  // of lensd
  std::map<std::string, Newest> newest_;  // by lens
  std::deque<FeedEntry> recent_;
  std::size_t recent_bytes_ = 0;
  std::deque<Past> past_;
  std::uint64_t last_number_ = 0;
  std::set<Subscriber*> subscribers_;
};

}  // namespace lensd::web
