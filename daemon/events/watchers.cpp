// Passes on what the lenses tell of themselves to the calls that wait for it, no faster than they read.
#include "daemon/events/watchers.h"

#include <algorithm>
#include <tuple>
#include <utility>
#include <vector>

#include "daemon/events/event_log.h"
#include "daemon/lens/served_lens.h"
#include "daemon/wire/lens_json.h"

namespace lensd::daemon {
namespace {

constexpr Duration kTick = std::chrono::milliseconds(10);
constexpr std::size_t kFewUnread = std::size_t{16} << 10;
constexpr std::size_t kMostUnread = std::size_t{256} << 10;

bool HearsEvents(const Watcher& watcher) {
  return watcher.tell == nullptr;
}

std::string_view FieldOf(Procedure procedure) {
  return procedure == Procedure::Autofocus ? "autofocus" : "backlash";
}

}  // namespace

bool Watchers::ByName::operator()(const ServedLens* a, const ServedLens* b) const {
  return a->name() < b->name();
}

void Watchers::Add(Watcher watcher) {
  const std::uint64_t key = watcher.exchange->number();
  watcher.exchange->OnGone([this, key] { loop_.Post([this, key] { watching_.erase(key); }); });
  watching_.emplace(key, Watching{.watcher = std::move(watcher)});
}

bool Watchers::Concerns(const Watching& watching, const ServedLens& lens) {
  return watching.watcher.only == nullptr || watching.watcher.only == &lens;
}

// ---- sending ------------------------------------------------------------------------------------------------------

void Watchers::SendEvent(Watching& watching, const ServedLens& lens, EventNumber number, std::string_view field,
                         std::string_view json) {
  watching.watcher.exchange->Continue(counts_.ReplyOf(lens.name(), number, field, json));
  watching.last[lens.name()] = number;
  ++watching.sent;
}

/// Everything that waits to be told of a lens, in the order in which it happened.
void Watchers::SendAbout(Watching& watching, const ServedLens& lens) {
  const auto found = watching.waiting.find(&lens);
  if (found == watching.waiting.end()) return;
  const Waiting waiting = std::move(found->second);
  watching.waiting.erase(found);
  if (!HearsEvents(watching.watcher)) {
    const auto reply = watching.watcher.tell(lens);
    if (!reply) return;
    watching.watcher.exchange->Continue(*reply);
    ++watching.sent;
    return;
  }
  using Item = std::tuple<EventNumber, std::string_view, std::string>;
  std::vector<Item> items;
  if (waiting.state.sequence > 0) items.emplace_back(waiting.state, "status", lens.text());
  for (const drivers::Axis axis : drivers::kAxes) {
    const auto& now = lens.status().axes[axis];
    if (waiting.moves[axis].sequence == 0 || !now) continue;
    items.emplace_back(waiting.moves[axis], "progress", Wrap("move", varlink::WriteJson(MoveProgressJson(axis, *now))));
  }
  for (const auto& [procedure, told] : waiting.procedures) {
    items.emplace_back(told.first, "progress", Wrap(FieldOf(procedure), told.second));
  }
  std::ranges::sort(items, {}, [](const Item& item) { return std::get<0>(item).sequence; });
  for (const auto& [number, field, json] : items) SendEvent(watching, lens, number, field, json);
}

void Watchers::TellNow(const ExchangePointer& exchange, const ServedLens& lens) {
  const auto found = watching_.find(exchange->number());
  if (found == watching_.end()) return;
  SendEvent(found->second, lens, counts_.Of(lens.name()), "status", lens.text());
}

void Watchers::TellOne(Watching& watching) {
  const Instant now = clock_.Now();
  if (watching.waiting.empty() || now < watching.next || watching.watcher.exchange->unread() > kFewUnread) return;
  while (!watching.waiting.empty()) SendAbout(watching, *watching.waiting.begin()->first);
  watching.next = now + watching.watcher.period;
}

/// Now if it is due and reads, else as soon as it is.
void Watchers::Hurry(Watching& watching) {
  TellOne(watching);
  if (watching.waiting.empty() || std::exchange(ticking_, true)) return;
  loop_.After(kTick, [this] {
    ticking_ = false;
    for (auto& [key, each] : watching_) Hurry(each);
  });
}

// ---- what happened ------------------------------------------------------------------------------------------------

void Watchers::Tell(const ServedLens& lens) {
  Waiting news{.state = counts_.Passing(lens.name())};
  for (const drivers::Axis axis : drivers::kAxes) {
    const auto& now = lens.status().axes[axis];
    if (now && now->moving) news.moves[axis] = counts_.Passing(lens.name());
  }
  for (auto& [key, watching] : watching_) {
    if (!Concerns(watching, lens)) continue;
    Waiting& waiting = watching.waiting[&lens];
    waiting.state = news.state;
    waiting.moves = news.moves;  // an axis that has come to rest has no progress any more
    Hurry(watching);
  }
}

void Watchers::TellProgress(const ServedLens& lens, Procedure procedure, const varlink::Json& progress) {
  const EventNumber number = counts_.Passing(lens.name());
  const std::string text = varlink::WriteJson(progress);
  for (auto& [key, watching] : watching_) {
    if (!HearsEvents(watching.watcher) || !Concerns(watching, lens)) continue;
    watching.waiting[&lens].procedures[procedure] = {number, text};
    Hurry(watching);
  }
}

void Watchers::Replace(const ServedLens& lens, const ServedLens* by) {
  std::vector<ExchangePointer> left;
  for (auto& [key, watching] : watching_) {
    watching.waiting.erase(&lens);
    if (watching.watcher.only != &lens) continue;
    watching.watcher.only = by;
    if (by == nullptr) left.push_back(watching.watcher.exchange);
  }
  for (const ExchangePointer& exchange : left) {
    Remove(exchange);
    exchange->Refuse("io.lensd.Lens.LensNotFound",
                     {{"message", "this lens was taken out of the configuration"}, {"lens", lens.name()}});
  }
  tallies_.erase(&lens);
  if (by != nullptr) Tell(*by);
}

Watchers::Tally Watchers::TallyOf(const ServedLens& lens) const {
  const auto found = tallies_.find(&lens);
  return found == tallies_.end() ? Tally{} : found->second;
}

void Watchers::CountResult(const ServedLens& lens, std::string_view field, const varlink::Json& event) {
  Tally& tally = tallies_[&lens];
  if (field == "move") {
    ++tally.moves;
    if (event.value("reached", false)) ++tally.reached;
    if (event.value("verified", false)) ++tally.verified;
    if (event.value("missed", false)) ++tally.missed;
    lens.users().work.settles.AddMs(event.value("elapsedMs", 0.0));
  } else if (field == "autofocus") {
    ++tally.autofocuses;
    if (event.value("focused", false)) ++tally.focused;
  }
}

void Watchers::Announce(const ServedLens& lens, std::string_view field, const varlink::Json& event) {
  CountResult(lens, field, event);
  LogResult(lens.name(), field, event);
  const EventNumber number = counts_.Lasting(lens.name());
  const std::string json = varlink::WriteJson(event);
  std::vector<ExchangePointer> too_slow;
  for (auto& [key, watching] : watching_) {
    if (!HearsEvents(watching.watcher) || !Concerns(watching, lens)) continue;
    if (watching.watcher.exchange->unread() > kMostUnread) {
      too_slow.push_back(watching.watcher.exchange);
      continue;
    }
    SendAbout(watching, lens);  // the state is new before the result
    SendEvent(watching, lens, number, field, json);
  }
  for (const ExchangePointer& exchange : too_slow) Drop(exchange);
}

void Watchers::AnnounceMoves(const ServedLens& lens, const varlink::Json& moves) {
  for (const varlink::Json& move : moves) Announce(lens, "move", move);
}

/// Who reads too slowly is told up to where it heard everything.
void Watchers::Drop(const ExchangePointer& exchange) {
  const Watching& watching = watching_.at(exchange->number());
  varlink::Json last = varlink::Json::array();
  for (const auto& [lens, number] : watching.last) {
    last.push_back({{"lens", lens}, {"sequence", number.sequence}, {"lasting", number.lasting}});
  }
  varlink::Json facts = {{"message", "events came faster than they were read"},
                         {"received", watching.sent},
                         {"instance", instance()},
                         {"last", std::move(last)}};
  Remove(exchange);
  exchange->Refuse("io.lensd.Lens.Overrun", std::move(facts));
}

}  // namespace lensd::daemon
