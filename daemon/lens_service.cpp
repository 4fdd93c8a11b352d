// Holds the lenses, the table of methods that serve them, and the rule how a call names its lens.
#include "lens_service.h"

#include <algorithm>
#include <utility>

#include "lens_json.h"
#include "proto/interfaces.h"
#include "serve.h"

namespace lensd::daemon {

LensService::LensService(EventLoop& loop, const Clock& clock, std::string state)
    : loop_(loop),
      clock_(clock),
      watchers_(loop, clock),
      surroundings_{loop, clock, watchers_, plug_signal_, files_, plans_, std::move(state)},
      definition_(BuiltInDefinition(proto::LensInterfaceText())) {
  for (const auto rows :
       {StatusMethods, DeviceMethods, MotionMethods, LeaseMethods, PlanMethods, AutofocusMethods, SessionMethods,
        PictureMethods, ExposureMethods, CalibrationMethods, PresetMethods, ReloadMethods}) {
    for (Method& method : rows(*this)) methods_.push_back(std::move(method));
  }
}

LensService::~LensService() {
  files_.End();  // what it writes belongs to lenses
  plans_.End();  // and what it solves
}

void LensService::AddLens(const LensConfig& config, ServedLens::Open open) {
  lenses_.push_back(std::make_unique<ServedLens>(config, surroundings_, std::move(open)));
}

void LensService::Begin() {
  for (const auto& lens : lenses_) lens->Begin();
}

void LensService::End() {
  plans_.RequestStop();
  for (const auto& lens : lenses_) lens->End("lensd is stopping");
}

Result<LensService::Replaced> LensService::Replace(const std::vector<LensConfig>& configs, const OpenerOf& opener) {
  constexpr std::size_t kMostRetired = 256;  // a megabyte each at most
  if (retired_.size() + lenses_.size() > kMostRetired) {
    return Fail(Code::Busy, "the configuration was changed too often since the start: restart lensd");
  }
  Replaced replaced;
  std::vector<std::unique_ptr<ServedLens>> before = std::exchange(lenses_, {});
  const auto named = [&](const std::string& name) {
    return std::ranges::find_if(before, [&](const auto& lens) { return lens && lens->name() == name; });
  };
  for (const LensConfig& config : configs) {
    const auto old = named(config.name);
    if (old != before.end() && SameLens((*old)->config(), config)) {
      replaced.unchanged.push_back(config.name);
      lenses_.push_back(std::move(*old));
      continue;
    }
    AddLens(config, opener(config));
    (old == before.end() ? replaced.added : replaced.reopened).push_back(config.name);
  }
  for (auto& lens : before) {
    if (!lens) continue;
    const auto next = std::ranges::find(lenses_, lens->name(), &ServedLens::name);
    const bool gone = next == lenses_.end();
    if (gone) replaced.removed.push_back(lens->name());
    lens->End(gone ? "lens \"" + lens->name() + "\" was taken out of the configuration"
                   : "lens \"" + lens->name() + "\" is configured anew");
    lens->users().lease.Drop(LensLease::End::Reopened);
    TellListed(*lens, gone ? "removed" : "reopened", lens->WhyAbsent()->message);
    watchers_.Replace(*lens, gone ? nullptr : next->get());
    if (!gone) BeginAfter(**next, *lens);
    retired_.push_back(std::move(lens));
  }
  for (const std::string& name : replaced.added) {
    ServedLens& lens = **std::ranges::find(lenses_, name, &ServedLens::name);
    watchers_.Tell(lens);
    TellListed(lens, "added", "");
    lens.Begin();
  }
  return replaced;
}

/// The list of lenses is another one, or this lens of it is configured in another way.
void LensService::TellListed(const ServedLens& lens, std::string_view change, const std::string& reason) {
  watchers_.Announce(lens, "list", {{"change", change}, {"connection", nullptr}, {"reason", TextOrNull(reason)}});
}

/// A device is opened once its last user has let go of it.
void LensService::BeginAfter(ServedLens& lens, const ServedLens& before) {
  constexpr Duration kPause = std::chrono::milliseconds(2);
  if (before.ended()) return lens.Begin();
  loop_.After(kPause, [this, &lens, &before] { BeginAfter(lens, before); });
}

std::vector<std::string> LensService::StillEnding() const {
  std::vector<std::string> names;
  for (const auto* lenses : {&lenses_, &retired_}) {
    for (const auto& lens : *lenses) {
      if (!lens->ended()) names.push_back(lens->name());
    }
  }
  return names;
}

bool LensService::Admit(const Method& method, const ExchangePointer& exchange) {
  return MayDrive(*this, method, exchange);
}

ServedLens* LensService::Named(const ExchangePointer& exchange) const {
  const auto name = exchange->view().Given("lens");
  if (!name) return lenses_.size() == 1 ? lenses_.front().get() : nullptr;
  const auto found = std::ranges::find_if(lenses_, [&](const auto& lens) { return lens->name() == name->text(); });
  return found == lenses_.end() ? nullptr : found->get();
}

ServedLens* LensService::Find(const ExchangePointer& exchange) {
  if (ServedLens* const lens = Named(exchange)) return lens;
  const auto name = exchange->view().Given("lens");
  std::string names;
  for (const auto& lens : lenses_) names += (names.empty() ? "" : ", ") + lens->name();
  if (!name && !lenses_.empty()) {
    Refuse(exchange, Wrong("say which lens: there is " + names, {.parameter = "lens"}));
    return nullptr;
  }
  const std::string what = name ? "there is no lens \"" + std::string(name->text()) + "\"; " : "";
  const std::string message = what + (lenses_.empty() ? "no lens is configured" : "there is " + names);
  varlink::Json facts{{"message", message}};
  if (name) facts["lens"] = name->text();
  exchange->Refuse("io.lensd.Lens.LensNotFound", std::move(facts));
  return nullptr;
}

ServedLens* LensService::FindPresent(const ExchangePointer& exchange) {
  ServedLens* const lens = Find(exchange);
  const auto why = lens == nullptr ? std::nullopt : lens->WhyAbsent();
  if (!why) return lens;
  Refuse(exchange, *lens, *why);
  return nullptr;
}

std::function<void(const ExchangePointer&)> LensService::ForPresent(std::function<void(const ExchangePointer&)> serve) {
  return [this, serve = std::move(serve)](const ExchangePointer& exchange) {
    ServedLens* const lens = Named(exchange);
    const bool parked = lens != nullptr && lens->OnceTried([serve, exchange] { serve(exchange); });
    if (!parked) serve(exchange);
  };
}

std::function<void(const ExchangePointer&)> LensService::ForLens(void (*serve)(ServedLens&, const ExchangePointer&)) {
  return ForPresent([this, serve](const ExchangePointer& exchange) {
    if (ServedLens* const lens = FindPresent(exchange)) serve(*lens, exchange);
  });
}

}  // namespace lensd::daemon
