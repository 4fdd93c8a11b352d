// Holds the lenses, the table of methods that serve them, and the rule how a call names its lens.
#include "daemon/methods/lens_service.h"

#include <algorithm>
#include <utility>

#include "daemon/events/failure_commands.h"
#include "daemon/methods/serve.h"
#include "daemon/wire/lens_json.h"
#include "proto/interfaces.h"

namespace lensd::daemon {

namespace {

/// As much of a name as a reply repeats, so that no call makes its answer long. No character is cut in two.
std::string_view Repeated(std::string_view name) {
  constexpr std::size_t kLongest = 64;
  if (name.size() <= kLongest) return name;
  std::size_t end = kLongest;
  while (end > 0 && (static_cast<unsigned char>(name[end]) & 0xC0U) == 0x80U) --end;
  return name.substr(0, end);
}

/// Empty: none of those that the lens was opened with.
std::string FileChangedUnder(const ServedLens& lens, const LensConfig& config,
                             const std::vector<FileMark>& calibrations) {
  const auto now = std::ranges::find(calibrations, lens.calibration_mark().path, &FileMark::path);
  if (now != calibrations.end() && *now != lens.calibration_mark()) return now->path;
  return ChangedFile(lens.config(), config);
}

}  // namespace

LensService::LensService(EventLoop& loop, const Clock& clock, std::string state)
    : watchers_(loop, clock),
      files_(loop),
      surroundings_{loop, clock, watchers_, plug_signal_, files_, plans_, std::move(state), clock.Now()},
      definition_(BuiltInDefinition(proto::LensInterfaceText())) {
  for (const auto rows :
       {StatusMethods, DeviceMethods, MotionMethods, LeaseMethods, PlanMethods, AutofocusMethods, FocusMapMethods,
        SessionMethods, PictureMethods, ExposureMethods, CalibrationMethods, FocusShiftMethods, FocusAtMethods,
        HoldMethods, PresetMethods, ReloadMethods, RefocusMethods, LearnedMethods}) {
    for (Method& method : rows(*this)) methods_.push_back(std::move(method));
  }
  methods_ = Described(definition_.name(), std::move(methods_));
}

LensService::~LensService() {
  files_.thread().End();  // what it writes belongs to lenses
  plans_.End();           // and what it solves
}

void LensService::AddLens(const LensConfig& config, ServedLens::Open open, const ServedLens* before) {
  lenses_.push_back(std::make_unique<ServedLens>(config, surroundings_, std::move(open), before));
}

void LensService::Begin() {
  for (const auto& lens : lenses_) lens->Begin();
}

Duration LensService::End(ServedLens::Parks parks) {
  plans_.RequestStop();
  Duration longest{};
  for (const auto& lens : lenses_) longest = std::max(longest, lens->End("lensd is stopping", parks));
  return longest;
}

std::vector<std::string> LensService::CalibrationFiles() const {
  std::vector<std::string> paths;
  for (const auto& lens : lenses_) {
    if (!lens->calibration_mark().path.empty()) paths.push_back(lens->calibration_mark().path);
  }
  return paths;
}

Result<LensService::Replaced> LensService::Replace(const std::vector<LensConfig>& configs, const OpenerOf& opener,
                                                   const std::vector<FileMark>& calibrations) {
  constexpr std::size_t kMostRetired = 256;  // a megabyte each at most
  if (files_.finishing()) return Fail(Code::Busy, "lensd is stopping");
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
    const std::string changed = old == before.end() ? "" : FileChangedUnder(**old, config, calibrations);
    if (!changed.empty()) replaced.changed_files.push_back(changed);
    const bool same = old != before.end() && changed.empty() && SameLens((*old)->config(), config);
    if (same && !(*old)->status().may_regain) {
      replaced.unchanged.push_back(config.name);
      lenses_.push_back(std::move(*old));
      continue;
    }
    AddLens(config, opener(config), old == before.end() ? nullptr : old->get());
    (old == before.end() ? replaced.added : replaced.reopened).push_back(config.name);
  }
  for (auto& lens : before) {
    if (!lens) continue;
    const auto next = std::ranges::find(lenses_, lens->name(), &ServedLens::name);
    const bool gone = next == lenses_.end();
    if (gone) replaced.removed.push_back(lens->name());
    lens->End(gone ? "lens \"" + lens->name() + "\" was taken out of the configuration"
                   : "lens \"" + lens->name() + "\" has a new configuration");
    if (gone) lens->users().lease.Drop(LensLease::End::Reopened);
    TellListed(*lens, gone ? "removed" : "reopened", lens->WhyAbsent()->message);
    watchers_.Replace(*lens, gone ? nullptr : next->get());
    if (!gone) (*next)->users().lease.GoOnFrom(lens->users().lease);
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

varlink::Json LensService::OwnMetrics() {
  const FailureCommands::Counts failures = FailureCommands::Get().counts();
  return {{"sinceNs", surroundings_.began.time_since_epoch().count()},
          {"filesWaiting", files_.thread().waiting()},
          {"plansWaiting", plans_.waiting()},
          {"failuresTold", failures.run},
          {"failuresNotTold", failures.failed},
          {"failuresDropped", failures.dropped}};
}

/// The list of lenses is another one, or this lens of it is configured in another way.
void LensService::TellListed(const ServedLens& lens, std::string_view change, const std::string& reason) {
  watchers_.Announce(lens, "list", {{"change", change}, {"connection", nullptr}, {"reason", TextOrNull(reason)}});
}

/// A device is opened once its last user has let go of it.
void LensService::BeginAfter(ServedLens& lens, const ServedLens& before) {
  constexpr Duration kPause = std::chrono::milliseconds(2);
  if (before.left() == ServedLens::Left::Nothing) return lens.Begin();
  loop().After(kPause, [this, &lens, &before] { BeginAfter(lens, before); });
}

void LensService::LookAfter() {
  for (const auto* lenses : {&lenses_, &retired_}) {
    for (const auto& lens : *lenses) lens->LookAfter();
  }
}

std::vector<const ServedLens*> LensService::StillEnding() const {
  std::vector<const ServedLens*> ending;
  for (const auto* lenses : {&lenses_, &retired_}) {
    for (const auto& lens : *lenses) {
      if (lens->left() != ServedLens::Left::Nothing || lens->stuck() > 0) ending.push_back(lens.get());
    }
  }
  return ending;
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
  std::optional<std::string> name;
  if (const auto given = exchange->view().Given("lens")) name = Repeated(given->text());
  std::string names;
  for (const auto& lens : lenses_) names += (names.empty() ? "" : ", ") + lens->name();
  if (!name && !lenses_.empty()) {
    Refuse(exchange, Wrong("say which lens: there is " + names, {.parameter = "lens"}));
    return nullptr;
  }
  const std::string what = name ? "there is no lens \"" + *name + "\"; " : "";
  const std::string message = what + (lenses_.empty() ? "no lens is configured" : "there is " + names);
  varlink::Json facts{{"message", message}};
  if (name) facts["lens"] = *name;
  exchange->Refuse("io.lensd.Lens.LensNotFound", std::move(facts));
  return nullptr;
}

ServedLens* LensService::FindPresent(const ExchangePointer& exchange, ServedLens::For what) {
  ServedLens* const lens = Find(exchange);
  const auto why = lens == nullptr ? std::nullopt : lens->WhyAbsent(what);
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
