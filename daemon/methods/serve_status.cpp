// List, Status, Monitor: everything answered from what the workers have published.
#include "daemon/methods/lens_service.h"
#include "daemon/methods/serve.h"
#include "daemon/wire/lens_json.h"
#include "proto/interfaces.h"

namespace lensd::daemon {
namespace {

constexpr double kLeastIntervalMs = 10.0;
constexpr double kMostIntervalMs = 10e3;

/// The lenses a call is about: the one it names, or all. Nothing: it has been told that there is no such lens.
std::optional<std::vector<const ServedLens*>> LensesMeant(LensService& service, const ExchangePointer& exchange) {
  std::vector<const ServedLens*> lenses;
  if (!exchange->view().Given("lens")) {
    for (const auto& lens : service.lenses()) lenses.push_back(lens.get());
    return lenses;
  }
  const ServedLens* const only = service.Find(exchange);
  if (only == nullptr) return std::nullopt;
  return std::vector{only};
}

/// For a watcher: null where all are meant.
const ServedLens* Only(const ExchangePointer& exchange, const std::vector<const ServedLens*>& lenses) {
  return exchange->view().Given("lens") ? lenses.front() : nullptr;
}

/// LensInfo, with what searches have learned of its cameras since it was opened.
std::string InfoOf(const ServedLens& lens) {
  std::string text = lens.info();
  text.pop_back();
  return text + ",\"lags\":" + varlink::WriteJson(lens.users().slope->LagsJson()) + "}";
}

void ListAsKnown(LensService& service, const ExchangePointer& exchange) {
  std::string reply = "{\"lenses\":[";
  for (const auto& lens : service.lenses()) reply += (lens == service.lenses().front() ? "" : ",") + InfoOf(*lens);
  // What was added since 1.0, each under a name that the comment of what was added gives.
  exchange->Finish(
      reply + R"(],"instance":")" + service.watchers().instance() +
      R"(","features":["badFrames","direction","focusAt","focusMap","hold","lag","learned","learnedSides","leftOut","process","refocus","searchConditions","setPosition","stars","stateBounds","undo"]})");
}

void List(LensService& service, const ExchangePointer& exchange) {
  for (const auto& lens : service.lenses()) {
    // What moves will tell what it has become when it rests.
    const bool idle = lens->status().activity.kind == rig::Activity::Kind::Idle;
    if (!idle || !lens->Outdated()) continue;
    return lens->Replan([&service, exchange](const Result<void>& replanned) {
      replanned ? List(service, exchange) : ListAsKnown(service, exchange);
    });
  }
  ListAsKnown(service, exchange);
}

void Status(LensService& service, const ExchangePointer& exchange) {
  const auto lenses = LensesMeant(service, exchange);
  if (!lenses) return;
  std::string reply = "{\"lenses\":[";
  for (const ServedLens* lens : *lenses) reply += (lens == lenses->front() ? "" : ",") + lens->text();
  reply += "]}";
  if (!exchange->call().more) return exchange->Finish(reply);
  exchange->Continue(reply);
  const auto tell = [](const ServedLens& lens) { return "{\"lenses\":[" + lens.text() + "]}"; };
  service.watchers().Add({exchange, Only(exchange, *lenses), tell});
}

void Metrics(LensService& service, const ExchangePointer& exchange) {
  const auto lenses = LensesMeant(service, exchange);
  if (!lenses) return;
  varlink::Json metrics = varlink::Json::array();
  for (const ServedLens* lens : *lenses) {
    const Watchers::Tally tally = service.watchers().TallyOf(*lens);
    const drivers::Counters& counters = lens->status().counters;
    const LensWork& work = lens->users().work;
    metrics.push_back({{"lens", lens->name()},
                       {"moves", tally.moves},
                       {"movesReached", tally.reached},
                       {"movesVerified", tally.verified},
                       {"movesMissed", tally.missed},
                       {"autofocuses", tally.autofocuses},
                       {"autofocusesFocused", tally.focused},
                       {"frames", counters.frames},
                       {"framesFlawed", counters.frames_flawed},
                       {"refused", work.refused.load()},
                       {"openings", work.openings.load()},
                       {"failures", work.failures.load()},
                       {"commandsWaiting", work.waiting.load()},
                       {"waitMs", work.waits.Told()},
                       {"settleMs", work.settles.Told()},
                       {"counters", CountersJson(lens->status())}});
  }
  exchange->Finish(varlink::WriteJson({{"lenses", std::move(metrics)}, {"daemon", service.OwnMetrics()}}));
}

void Monitor(LensService& service, const ExchangePointer& exchange) {
  const auto lenses = LensesMeant(service, exchange);
  if (!lenses) return;
  Duration period = Watcher::kDefaultPeriod;
  if (const auto least = exchange->view().Given("minIntervalMs")) {
    if (!(least->number() >= kLeastIntervalMs && least->number() <= kMostIntervalMs)) {
      return Refuse(
          exchange,
          Wrong("minIntervalMs is from 10 to 10000",
                {.parameter = "minIntervalMs", .minimum = kLeastIntervalMs, .maximum = kMostIntervalMs, .unit = "ms"}));
    }
    period = std::chrono::duration_cast<Duration>(std::chrono::duration<double, std::milli>(least->number()));
  }
  service.watchers().Add({exchange, Only(exchange, *lenses), nullptr, period});
  for (const ServedLens* lens : *lenses) service.watchers().TellNow(exchange, *lens);
}

}  // namespace

MethodTable StatusMethods(LensService& service) {
  return {{"List", [&service](const ExchangePointer& exchange) { List(service, exchange); }},
          {"Status", [&service](const ExchangePointer& exchange) { Status(service, exchange); }},
          {"Metrics", [&service](const ExchangePointer& exchange) { Metrics(service, exchange); }},
          {"Monitor", [&service](const ExchangePointer& exchange) { Monitor(service, exchange); }}};
}

}  // namespace lensd::daemon
