// Passes on what the lenses tell of themselves to the calls that wait for it, no faster than they read.
#include "watchers.h"

#include <utility>
#include <vector>

namespace lensd::daemon {
namespace {

constexpr Duration kTick = std::chrono::milliseconds(10);
constexpr std::size_t kFewUnread = std::size_t{16} << 10;
constexpr std::size_t kMostUnread = std::size_t{256} << 10;

}  // namespace

void Watchers::Add(Watcher watcher) {
  const Exchange* const key = watcher.exchange.get();
  watcher.exchange->OnGone([this, key] { loop_.Post([this, key] { watching_.erase(key); }); });
  watching_.emplace(key, Watching{std::move(watcher), {}, {}, 0});
}

bool Watchers::Concerns(const Watching& watching, const ServedLens& lens) {
  return watching.watcher.only == nullptr || watching.watcher.only == &lens;
}

void Watchers::Send(Watching& watching) {
  for (const ServedLens* lens : std::exchange(watching.changed, {})) {
    const auto reply = watching.watcher.tell(*lens);
    if (!reply) continue;
    watching.watcher.exchange->Continue(*reply);
    ++watching.sent;
  }
}

void Watchers::TellOne(Watching& watching) {
  const Instant now = clock_.Now();
  if (watching.changed.empty() || now < watching.next || watching.watcher.exchange->unread() > kFewUnread) return;
  Send(watching);
  watching.next = now + watching.watcher.period;
}

void Watchers::Tell(const ServedLens& lens) {
  bool waiting = false;
  for (auto& [key, watching] : watching_) {
    if (!Concerns(watching, lens)) continue;
    watching.changed.insert(&lens);
    TellOne(watching);
    waiting |= !watching.changed.empty();
  }
  if (waiting && !std::exchange(ticking_, true)) loop_.After(kTick, [this] { Tick(); });
}

void Watchers::Replace(const ServedLens& lens, const ServedLens* by) {
  std::vector<ExchangePointer> left;
  for (auto& [key, watching] : watching_) {
    watching.changed.erase(&lens);
    if (watching.watcher.only != &lens) continue;
    watching.watcher.only = by;
    if (by == nullptr) left.push_back(watching.watcher.exchange);
  }
  for (const ExchangePointer& exchange : left) {
    Remove(exchange);
    exchange->Refuse("io.lensd.Lens.LensNotFound", {{"message", "this lens was taken out of the configuration"}});
  }
  tallies_.erase(&lens);
  if (by != nullptr) Tell(*by);
}

/// Until nobody waits.
void Watchers::Tick() {
  bool waiting = false;
  for (auto& [key, watching] : watching_) {
    TellOne(watching);
    waiting |= !watching.changed.empty();
  }
  ticking_ = waiting;
  if (waiting) loop_.After(kTick, [this] { Tick(); });
}

Watchers::Tally Watchers::TallyOf(const ServedLens& lens) const {
  const auto found = tallies_.find(&lens);
  return found == tallies_.end() ? Tally{} : found->second;
}

void Watchers::Announce(const ServedLens& lens, std::string_view field, const varlink::Json& result) {
  Tally& tally = tallies_[&lens];
  if (field == "move") {
    ++tally.moves;
    if (result.value("reached", false)) ++tally.reached;
    if (result.value("verified", false)) ++tally.verified;
  } else {
    ++tally.autofocuses;
    if (result.value("focused", false)) ++tally.focused;
  }
  const std::string event = "{\"event\":{\"" + std::string(field) + "\":" + varlink::WriteJson(result) + "}}";
  std::vector<ExchangePointer> too_slow;
  for (auto& [key, watching] : watching_) {
    if (!watching.watcher.wants_events || !Concerns(watching, lens)) continue;
    const ExchangePointer& exchange = watching.watcher.exchange;
    if (exchange->unread() > kMostUnread) {
      too_slow.push_back(exchange);
      continue;
    }
    // The state is new before the result.
    if (watching.changed.contains(&lens)) Send(watching);
    exchange->Continue(event);
    ++watching.sent;
  }
  for (const ExchangePointer& exchange : too_slow) {
    const std::int64_t sent = watching_.at(exchange.get()).sent;
    Remove(exchange);
    exchange->Refuse("io.lensd.Lens.Overrun",
                     {{"message", "events came faster than they were read"}, {"received", sent}});
  }
}

void Watchers::AnnounceMoves(const ServedLens& lens, const varlink::Json& moves) {
  for (const varlink::Json& move : moves) Announce(lens, "move", move);
}

}  // namespace lensd::daemon
