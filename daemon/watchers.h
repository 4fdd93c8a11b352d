// Who hears of changes without asking again: Status with `more`, Monitor, Move with `more`.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "base/clock.h"
#include "event_loop.h"
#include "exchange.h"
#include "varlink/json.h"

namespace lensd::daemon {

class ServedLens;

/// A call that hears of every change of one lens, or of all. What changed is told at most once a period, and only to
/// who has read what came before: of each lens the newest state, so that nobody is told of the past.
struct Watcher {
  ExchangePointer exchange;
  const ServedLens* only = nullptr;  ///< null: all lenses
  /// The reply that tells the state of a lens; nothing: it does not concern this call.
  std::function<std::optional<std::string>(const ServedLens&)> tell;
  bool wants_events = false;  ///< also hears of finished moves and autofocus, every one
  Duration period = kDefaultPeriod;

  static constexpr Duration kDefaultPeriod = std::chrono::milliseconds(40);
};

/// Event loop thread only.
class Watchers {
 public:
  Watchers(EventLoop& loop, const Clock& clock) : loop_(loop), clock_(clock) {}

  /// Until its client goes or Remove().
  void Add(Watcher watcher);
  void Remove(const ExchangePointer& exchange) { watching_.erase(exchange.get()); }
  /// The state of `lens` is another one.
  void Tell(const ServedLens& lens);
  /// `lens` is no longer served: who watched it alone watches the one in its place, or is told that there is none.
  void Replace(const ServedLens& lens, const ServedLens* by);
  /// Something of `lens` ended: `result` is the field of an Event. Who reads so slowly that even these pile up is
  /// dropped, and told how many replies it got.
  void Announce(const ServedLens& lens, std::string_view field, const varlink::Json& result);
  void AnnounceMoves(const ServedLens& lens, const varlink::Json& moves);

  /// What has been announced of a lens so far.
  struct Tally {
    std::int64_t moves = 0, reached = 0, verified = 0, autofocuses = 0, focused = 0;
  };
  Tally TallyOf(const ServedLens& lens) const;

 private:
  struct Watching {
    Watcher watcher;
    std::set<const ServedLens*> changed;  ///< and not told yet
    Instant next{};                       ///< when it may be told
    std::int64_t sent = 0;
  };
  static bool Concerns(const Watching& watching, const ServedLens& lens);
  static void Send(Watching& watching);
  void TellOne(Watching& watching);
  void Tick();

  EventLoop& loop_;
  const Clock& clock_;
  std::map<const Exchange*, Watching> watching_;
  std::map<const ServedLens*, Tally> tallies_;
  bool ticking_ = false;
};

}  // namespace lensd::daemon
