// One ring of recent events serves every page. A page that reads slowly, or comes back late, finds its place
// overwritten and is told so: there is never a queue.
#include "web/event_feed.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <random>
#include <utility>

namespace lensd::web {
namespace {

using std::chrono::milliseconds;
using varlink::Json;
constexpr std::size_t kRecent = 512, kRecentBytes = std::size_t{4} << 20, kPast = 2000;
constexpr auto kHistory = std::chrono::hours(1);
constexpr Duration kListAtMost = std::chrono::seconds(10);
constexpr Duration kMonitorAtMost = std::chrono::years(100);
constexpr double kMinIntervalMs = 50;
constexpr milliseconds kFirstPause{250}, kLongestPause{30000};
// Proxies and networks forget connections on which nothing comes.
constexpr Duration kPing = std::chrono::seconds(15);
constexpr std::array kPassing{"status", "progress"};

bool IsSet(const Json& event, const char* field) {
  return event.contains(field) && !event[field].is_null();
}

bool IsLasting(const Json& event) {
  return std::ranges::none_of(kPassing, [&](const char* field) { return IsSet(event, field); });
}

/// Numbers of another run of lens-web mean nothing.
const std::string& RunName() {
  static const std::string name = [] {
    std::random_device random;
    return std::to_string((std::uint64_t{random()} << 32) | random());
  }();
  return name;
}

std::string EventText(std::string_view kind, const Json& data) {
  return (kind.empty() ? std::string() : "event: " + std::string(kind) + "\n") + "data: " + varlink::WriteJson(data) +
         "\n\n";
}

/// The number in "RUN-NUMBER", if it is of this run.
std::optional<std::uint64_t> NumberIn(std::string_view id) {
  const std::string prefix = RunName() + "-";
  if (!id.starts_with(prefix)) return std::nullopt;
  std::uint64_t number = 0;
  const auto read = std::from_chars(id.data() + prefix.size(), id.data() + id.size(), number);
  if (read.ec != std::errc{} || read.ptr != id.data() + id.size()) return std::nullopt;
  return number;
}

}  // namespace

/// One page. Held by its exchange.
class Subscriber {
 public:
  Subscriber(EventFeed& feed, Exchange& exchange, std::string lens);
  ~Subscriber() { feed_.subscribers_.erase(this); }
  void HasNew();
  std::optional<std::size_t> Read(char* to, std::size_t size);

 private:
  bool Wants(const std::string& lens) const { return lens.empty() || lens_.empty() || lens == lens_; }
  void Resume(std::string_view last_id);
  void TellNow();
  void Collect();
  void Ping();

  EventFeed& feed_;
  Exchange& exchange_;
  const std::string lens_;
  std::string pending_;
  std::size_t sent_ = 0;    // of pending_
  std::uint64_t told_ = 0;  // number of the last event in pending_ or before
  Watch ping_;
};

Subscriber::Subscriber(EventFeed& feed, Exchange& exchange, std::string lens)
    : feed_(feed), exchange_(exchange), lens_(std::move(lens)), pending_("retry: 1000\n\n") {
  Resume(exchange.Header("Last-Event-ID"));
  feed_.subscribers_.insert(this);
  Ping();
}

void Subscriber::Resume(std::string_view last_id) {
  const auto number = NumberIn(last_id);
  const std::uint64_t oldest = feed_.recent_.empty() ? feed_.last_number_ + 1 : feed_.recent_.front().number;
  if (number && *number <= feed_.last_number_ && *number + 1 >= oldest) {
    told_ = *number;
    return;
  }
  if (!last_id.empty()) {
    // What another run of lens-web told, this one cannot count.
    const Json missed = number && *number <= feed_.last_number_ ? Json(feed_.last_number_ - *number) : Json(nullptr);
    pending_ += EventText("gap", {{"missed", missed}});
  }
  TellNow();
}

void Subscriber::TellNow() {
  told_ = feed_.last_number_;
  pending_ += "id: " + RunName() + "-" + std::to_string(told_) + "\n";
  const bool up = feed_.down_.empty();
  Json daemon{{"connected", up}};
  if (!up) daemon["message"] = feed_.down_;
  pending_ += EventText("daemon", daemon);
  for (const auto& [lens, newest] : feed_.newest_) {
    if (!Wants(lens) || newest.state.is_null()) continue;
    // As lensd's own streams begin: with the numbers of what happened last.
    Json state = newest.state;
    state["sequence"] = newest.sequence;
    state["lasting"] = newest.lasting;
    pending_ += EventText("", state);
  }
}

void Subscriber::Collect() {
  const auto& recent = feed_.recent_;
  if (!recent.empty() && recent.front().number > told_ + 1) {
    pending_ += EventText("gap", {{"missed", feed_.last_number_ - told_}});
    return TellNow();
  }
  const auto first = std::ranges::upper_bound(recent, told_, {}, &FeedEntry::number);
  for (auto entry = first; entry != recent.end(); ++entry) {
    told_ = entry->number;
    if (!Wants(entry->lens)) continue;
    pending_ += "id: " + RunName() + "-" + std::to_string(entry->number) + "\n" + entry->text;
  }
}

void Subscriber::Ping() {
  ping_ = feed_.link_.loop().After(kPing, [this] {
    if (pending_.empty()) pending_ = ": ping\n\n";
    HasNew();
    Ping();
  });
}

void Subscriber::HasNew() {
  exchange_.Wake();
}

std::optional<std::size_t> Subscriber::Read(char* to, std::size_t size) {
  if (sent_ == pending_.size()) {
    pending_.clear();
    sent_ = 0;
    Collect();
  }
  const std::size_t count = std::min(size, pending_.size() - sent_);
  std::memcpy(to, pending_.data() + sent_, count);
  sent_ += count;
  return count;
}

EventFeed::EventFeed(const LensdLink& link) : link_(link) {
  Connect();
}

EventFeed::~EventFeed() = default;

/// Asks for the list first: Monitor says nothing where no lens is configured.
void EventFeed::Connect() {
  call_ = link_.Begin("List", Json::object(), /*more=*/false, kListAtMost,
                      {.reply = [this](const varlink::Reply& reply, const File&) { Greet(reply); },
                       .failed = [this](const Error& why) { Retry(why.message); }});
}

void EventFeed::Follow() {
  call_ = link_.Begin("Monitor", {{"minIntervalMs", kMinIntervalMs}}, /*more=*/true, kMonitorAtMost,
                      {.reply = [this](const varlink::Reply& reply, const File&) { Take(reply); },
                       .failed = [this](const Error& why) { Retry(why.message); }});
}

void EventFeed::Greet(const varlink::Reply& list) {
  if (!list.error.empty()) return Retry(list.parameters.value("message", list.error));
  if (const std::string instance = list.parameters.value("instance", ""); instance != instance_) {
    // A lensd that was started anew: what was known of the old one's lenses is nothing any more.
    if (!instance_.empty()) Append("", EventText("gap", {{"missed", nullptr}}));
    instance_ = instance;
    newest_.clear();
  }
  pause_ = milliseconds(0);
  if (!down_.empty()) {
    down_.clear();
    TellDaemon();
  }
  Follow();
}

void EventFeed::Retry(const std::string& why) {
  call_.reset();
  if (down_ != why) {
    down_ = why;
    TellDaemon();
  }
  pause_ = std::clamp(pause_ * 2, kFirstPause, kLongestPause);
  again_ = link_.loop().After(pause_, [this] { Connect(); });
}

void EventFeed::TellDaemon() {
  Json told{{"connected", down_.empty()}};
  if (!down_.empty()) told["message"] = down_;
  Append("", EventText("daemon", told));
}

void EventFeed::Take(const varlink::Reply& reply) {
  if (!reply.error.empty()) return Retry(reply.parameters.value("message", reply.error));
  const Json& event = reply.parameters["event"];
  const std::string lens = event.value("lens", "");
  Count(lens, event);
  Remember(event);
  Append(lens, EventText("", event));
}

/// Lasting events are missed while there is no stream alone, and each lens' count tells how many.
void EventFeed::Count(const std::string& lens, const Json& event) {
  const auto [found, first] = newest_.try_emplace(lens);
  Newest& newest = found->second;
  const auto lasting = event.value("lasting", std::int64_t{0});
  const std::int64_t missed = lasting - newest.lasting - (IsLasting(event) ? 1 : 0);
  if (!first && missed > 0) Append("", EventText("gap", {{"missed", missed}}));
  newest.lasting = lasting;
  newest.sequence = event.value("sequence", std::int64_t{0});
  if (IsSet(event, "status")) newest.state = event;
}

void EventFeed::Remember(const Json& event) {
  if (!IsLasting(event)) return;
  if (IsSet(event, "list") && event["list"].value("change", "") == "removed") newest_.erase(event.value("lens", ""));
  Json kept = event;
  if (kept.contains("autofocus")) kept["autofocus"].erase("samples");
  past_.push_back({std::chrono::system_clock::now(), std::move(kept)});
  if (past_.size() > kPast) ForgetOne();
}

/// The oldest of the lens that has most: one that moves all the time takes the place of no other's events.
void EventFeed::ForgetOne() {
  const auto lens = [](const Past& past) { return past.event.value("lens", ""); };
  std::map<std::string, std::size_t> counts;
  for (const Past& past : past_) ++counts[lens(past)];
  const auto most = std::ranges::max_element(counts, {}, [](const auto& entry) { return entry.second; });
  past_.erase(std::ranges::find(past_, most->first, lens));
}

Json EventFeed::History() {
  const auto now = std::chrono::system_clock::now();
  std::erase_if(past_, [&](const Past& past) { return now - past.at > kHistory; });
  Json events = Json::array();
  for (const Past& past : past_) {
    const auto at = std::chrono::duration_cast<milliseconds>(past.at.time_since_epoch()).count();
    events.push_back({{"atMs", at}, {"event", past.event}});
  }
  return {{"events", std::move(events)}};
}

void EventFeed::Append(std::string lens, std::string text) {
  recent_bytes_ += text.size();
  recent_.push_back({++last_number_, std::move(lens), std::move(text)});
  while (recent_.size() > kRecent || (recent_.size() > 1 && recent_bytes_ > kRecentBytes)) {
    recent_bytes_ -= recent_.front().text.size();
    recent_.pop_front();
  }
  for (Subscriber* subscriber : subscribers_) subscriber->HasNew();
}

void EventFeed::Subscribe(Exchange& exchange, const std::string& lens) {
  class Body final : public Stream {
   public:
    explicit Body(std::shared_ptr<Subscriber> subscriber) : subscriber_(std::move(subscriber)) {}
    std::optional<std::size_t> Read(char* to, std::size_t size) override { return subscriber_->Read(to, size); }

   private:
    const std::shared_ptr<Subscriber> subscriber_;
  };
  exchange.Reply("text/event-stream", std::make_unique<Body>(std::make_shared<Subscriber>(*this, exchange, lens)));
}

}  // namespace lensd::web
