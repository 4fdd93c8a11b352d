// Who hears of changes without asking again: Status with `more`, Monitor, Move with `more`.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "base/clock.h"
#include "daemon/events/event_counts.h"
#include "daemon/server/exchange.h"
#include "drivers/api/lens.h"
#include "loop/event_loop.h"
#include "varlink/json.h"

namespace lensd::daemon {

class ServedLens;

/// A call that hears of every change of one lens, or of all. What changed is told at most once a period, and only to
/// who has read what came before: of each lens the newest state, so that no client is told of the past.
struct Watcher {
  ExchangePointer exchange;
  const ServedLens* only = nullptr;  ///< null: all lenses
  /// The reply that tells the state of a lens; nothing: it does not concern this call. Null: it hears every kind of
  /// event, as Monitor tells them.
  std::function<std::optional<std::string>(const ServedLens&)> tell;
  Duration period = kDefaultPeriod;

  static constexpr Duration kDefaultPeriod = std::chrono::milliseconds(40);
};

/// What takes many moves and frames, and tells how far it has come.
enum class Procedure { Autofocus, Backlash };

/// Event loop thread only.
class Watchers {
 public:
  Watchers(EventLoop& loop, const Clock& clock) : loop_(loop), clock_(clock) {}

  /// Until its client goes or Remove().
  void Add(Watcher watcher);
  void Remove(const ExchangePointer& exchange) { watching_.erase(exchange->number()); }
  /// Tells a call that hears of events how a lens stands, whether that is new or not.
  void TellNow(const ExchangePointer& exchange, const ServedLens& lens);
  /// The state of `lens` is another one.
  void Tell(const ServedLens& lens);
  /// How far it has come with something.
  void TellProgress(const ServedLens& lens, Procedure procedure, const varlink::Json& progress);
  /// `lens` is no longer served: who watched it alone watches the one in its place, or is told that there is none.
  void Replace(const ServedLens& lens, const ServedLens* by);
  /// Something happened to `lens` that no monitor is spared: `event` is the field of an Event. Who reads so slowly that
  /// even these pile up is dropped, and told up to where it heard everything.
  void Announce(const ServedLens& lens, std::string_view field, const varlink::Json& event);
  void AnnounceMoves(const ServedLens& lens, const varlink::Json& moves);

  /// What has been announced of a lens so far.
  struct Tally {
    std::int64_t moves = 0, reached = 0, missed = 0, verified = 0, autofocuses = 0, focused = 0;
  };
  Tally TallyOf(const ServedLens& lens) const;
  /// Names this run of the daemon.
  const std::string& instance() const { return counts_.instance(); }

 private:
  struct ByName {
    bool operator()(const ServedLens* a, const ServedLens* b) const;
  };
  /// What a call has not been told of a lens yet; of each kind the newest. A number of 0: nothing.
  struct Waiting {
    EventNumber state{};
    drivers::PerAxis<EventNumber> moves{};
    std::map<Procedure, std::pair<EventNumber, std::string>> procedures{};
  };
  struct Watching {
    Watcher watcher;
    std::map<const ServedLens*, Waiting, ByName> waiting{};
    Instant next{};  ///< when it may be told
    std::int64_t sent = 0;
    std::map<std::string, EventNumber> last{};  ///< told, by lens
  };
  static bool Concerns(const Watching& watching, const ServedLens& lens);
  void CountResult(const ServedLens& lens, std::string_view field, const varlink::Json& event);
  void SendEvent(Watching& watching, const ServedLens& lens, EventNumber number, std::string_view field,
                 std::string_view json);
  void SendAbout(Watching& watching, const ServedLens& lens);
  void TellOne(Watching& watching);
  void Hurry(Watching& watching);
  void Drop(const ExchangePointer& exchange);

  EventLoop& loop_;
  const Clock& clock_;
  EventCounts counts_;
  std::map<std::uint64_t, Watching> watching_;  // by the number of the call: who asked first is told first
  std::map<const ServedLens*, Tally> tallies_;
  bool ticking_ = false;
};

}  // namespace lensd::daemon
