#include "lens_service.h"

#include <algorithm>
#include <utility>

#include "lens_entry.h"
#include "lens_json.h"
#include "log.h"
#include "proto/interfaces.h"

namespace lensd::daemon {

using proto::Json;

LensService::LensService(EventLoop& loop, const Clock& clock)
    : loop_(loop), clock_(clock), definition_(BuiltInDefinition(proto::LensInterfaceText())) {
  handlers_ = {{"List", &LensService::List},
               {"Status", &LensService::Status},
               {"Monitor", &LensService::Monitor},
               {"Move", &LensService::Move},
               {"Home", &LensService::Home},
               {"Stop", &LensService::Stop},
               {"Plan", &LensService::Plan},
               {"Autofocus", &LensService::Autofocus},
               {"Snapshot", &LensService::Snapshot},
               {"AutofocusBegin", &LensService::AutofocusBegin},
               {"AutofocusPixels", &LensService::AutofocusPixels},
               {"AutofocusFrame", &LensService::AutofocusFrame},
               {"AutofocusScore", &LensService::AutofocusScore},
               {"AutofocusEnd", &LensService::AutofocusEnd}};
}

LensService::~LensService() = default;

Result<void> LensService::AddLens(const LensConfig& config, drivers::Device device) {
  auto rig = rig::Rig::Create(config.rig, std::move(device), clock_);
  if (!rig) return PassOn(std::move(rig));
  auto lens = std::make_unique<Lens>();
  Lens& entry = *lens;
  entry.name = config.name;
  entry.planning = PlanningOf(**rig, config.rig);
  entry.info = proto::WriteJson(InfoJson(config.name, **rig, config.rig, entry.planning));
  auto status = std::make_shared<const rig::Status>((*rig)->GetStatus());
  Json text = StatusJson(config.name, *status);
  text["readAtMs"] = std::chrono::duration<double, std::milli>(status->sampled_at.time_since_epoch()).count();
  entry.text = proto::WriteJson(text);
  entry.status = std::move(status);
  lenses_.push_back(std::move(lens));
  entry.worker = std::make_unique<Worker>(*std::move(rig), clock_,
                                          [this, &entry](const rig::Status& now, std::vector<Worker::Task> later) {
                                            Published(entry, now, std::move(later));
                                          });
  if (config.home_at_start) HomeAtStart(entry);
  return {};
}

/// On the worker's thread.
void LensService::Published(Lens& lens, const rig::Status& status, std::vector<Worker::Task> later) {
  Json json = StatusJson(lens.name, status);
  std::string without_time = proto::WriteJson(json);
  const bool changed = without_time != lens.published;
  lens.published = std::move(without_time);
  json["readAtMs"] = std::chrono::duration<double, std::milli>(status.sampled_at.time_since_epoch()).count();
  loop_.Post([this, &lens, copy = std::make_shared<const rig::Status>(status), text = proto::WriteJson(json), changed,
              tasks = std::move(later)]() mutable {
    Update(lens, std::move(copy), std::move(text), changed);
    for (Worker::Task& task : tasks) task();
  });
}

void LensService::Update(Lens& lens, std::shared_ptr<const rig::Status> status, std::string text, bool changed) {
  const bool was_connected = lens.status->connected;
  lens.status = std::move(status);
  lens.text = std::move(text);
  if (lens.status->connected != was_connected) {
    if (lens.status->connected) {
      Log(Severity::Info, Event::LensReady, "the lens answers", lens.name);
    } else {
      Log(Severity::Warning, Event::LensLost, lens.status->problem, lens.name);
    }
  }
  if (!changed) return;
  for (auto& [key, watcher] : watchers_) {
    if (watcher.only == nullptr || watcher.only == &lens) watcher.changed(lens);
  }
}

void LensService::Serve(std::string_view method, const ExchangePointer& exchange) {
  (this->*handlers_.at(method))(exchange);
}

LensService::Lens* LensService::FindLens(const ExchangePointer& exchange) {
  const Json& parameters = exchange->parameters();
  const auto named = parameters.find("lens");
  std::string names;
  for (const auto& lens : lenses_) {
    if (named != parameters.end() && *named == lens->name) return lens.get();
    names += (names.empty() ? "" : ", ") + lens->name;
  }
  const bool has_name = named != parameters.end() && !named->is_null();
  if (!has_name && lenses_.size() == 1) return lenses_.front().get();
  if (!has_name && !lenses_.empty()) {
    Refuse(exchange, {Code::InvalidArgument, "say which lens: there is " + names});
    return nullptr;
  }
  const std::string what = has_name ? "there is no lens \"" + named->get<std::string>() + "\"; " : "";
  const std::string message = what + (lenses_.empty() ? "no lens is configured" : "there is " + names);
  exchange->Refuse("io.lensd.Lens.LensNotFound", {{"message", message}});
  return nullptr;
}

void LensService::Watch(Watcher watcher) {
  const Exchange* const key = watcher.exchange.get();
  watcher.exchange->OnGone([this, key] { loop_.Post([this, key] { Unwatch(key); }); });
  watchers_.emplace(key, std::move(watcher));
}

void LensService::Announce(const Lens& lens, std::string_view field, const std::string& result) {
  const std::string event = "{\"event\":{\"" + std::string(field) + "\":" + result + "}}";
  for (auto& [key, watcher] : watchers_) {
    if (watcher.wants_events && (watcher.only == nullptr || watcher.only == &lens)) watcher.exchange->Continue(event);
  }
}

void LensService::AnnounceMoves(const Lens& lens, const Json& moves) {
  for (const Json& move : moves) Announce(lens, "move", proto::WriteJson(move));
}

void LensService::Refuse(const ExchangePointer& exchange, const Error& error) {
  exchange->Refuse(ErrorName(error.code), {{"message", error.message}});
}

}  // namespace lensd::daemon
