// Presets: saved, listed, recalled and removed.
#include <algorithm>
#include <ctime>
#include <utility>

#include "daemon/lens/move_group.h"
#include "daemon/methods/lens_service.h"
#include "daemon/methods/serve.h"
#include "daemon/wire/lens_json.h"
#include "rig/presets.h"

namespace lensd::daemon {
namespace {

using varlink::Json;

constexpr std::size_t kMostPresets = 1000;

std::string Now() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc)};
}

void RefuseUnknown(const ServedLens& lens, const ExchangePointer& exchange, const std::vector<rig::Preset>& presets,
                   const std::string& label) {
  std::string names;
  for (const rig::Preset& preset : presets) names += (names.empty() ? "" : ", ") + preset.label;
  exchange->Refuse(
      "io.lensd.Lens.PresetNotFound",
      {{"message", "there is no preset \"" + label + "\"; " + (names.empty() ? "none is saved" : "there is " + names)},
       {"lens", lens.name()},
       {"label", label}});
}

/// What a preset recalled and a lens brought back have in common.
Json BroughtBack(const std::string& lens, const rig::RecallOutcome& outcome) {
  const auto number = [](const auto& value) { return value ? varlink::NumberOrNull(value->value) : Json(nullptr); };
  return {{"lens", lens},
          {"vergenceBoundD", number(outcome.vergence_bound)},
          {"positionBound", number(outcome.native_bound)},
          {"moves", MovesJson(lens, outcome.moves)},
          {"note", TextOrNull(outcome.remark)}};
}

/// What to say where presets are in memory alone; null where they are kept.
Json NoteOnKeeping(const ServedLens& lens) {
  if (!lens.surroundings().state.empty()) return nullptr;
  return "presets are lost when lensd ends, since it runs without a state folder: start it with lensd --state DIR";
}

std::string LabelOf(const ExchangePointer& exchange) {
  return exchange->parameters()["label"].get<std::string>();
}

void Keep(ServedLens& lens, const ExchangePointer& exchange, rig::Preset preset) {
  preset.saved = Now();
  const auto put = [preset](std::vector<rig::Preset>& presets) -> Result<void> {
    std::erase_if(presets, [&](const rig::Preset& old) { return old.label == preset.label; });
    if (presets.size() >= kMostPresets) return Fail(Code::OutOfRange, "1000 presets are saved already: remove some");
    presets.push_back(preset);
    return {};
  };
  lens.ChangePresets(put, [&lens, exchange, preset](const Result<void>& kept) {
    if (!kept) return Refuse(exchange, lens, kept.error());
    exchange->Finish(varlink::WriteJson({{"preset", PresetJson(preset)}, {"note", NoteOnKeeping(lens)}}));
    lens.watchers().Announce(lens, "preset", {{"change", "saved"}, {"label", preset.label}});
  });
}

void Save(ServedLens& lens, const ExchangePointer& exchange) {
  const auto take = [label = LabelOf(exchange)](rig::Rig& rig, auto done) { done(rig::TakePreset(rig, label)); };
  lens.Ask<rig::Preset>(take, [exchange, &lens](const Result<rig::Preset>& taken) {
    if (!taken) return Refuse(exchange, lens, taken.error());
    Keep(lens, exchange, *taken);
  });
}

void List(ServedLens& lens, const ExchangePointer& exchange) {
  if (!lens.presets()) return Refuse(exchange, lens, lens.presets().error());
  Json presets = Json::array();
  for (const rig::Preset& preset : *lens.presets()) presets.push_back(PresetJson(preset));
  Json reply{{"presets", std::move(presets)}};
  if (!reply["presets"].empty()) reply["note"] = NoteOnKeeping(lens);
  exchange->Finish(varlink::WriteJson(reply));
}

/// The preset the call names; else answers the call with why not and returns null.
const rig::Preset* Find(const ServedLens& lens, const ExchangePointer& exchange) {
  if (!lens.presets()) return Refuse(exchange, lens, lens.presets().error()), nullptr;
  const std::vector<rig::Preset>& presets = *lens.presets();
  const std::string label = LabelOf(exchange);
  const auto found = std::ranges::find(presets, label, &rig::Preset::label);
  if (found != presets.end()) return &*found;
  RefuseUnknown(lens, exchange, presets, label);
  return nullptr;
}

void Recall(ServedLens& lens, const ExchangePointer& exchange) {
  const rig::Preset* const preset = Find(lens, exchange);
  if (preset == nullptr) return;
  const auto recall = [preset = *preset](rig::Rig& rig, auto done) { rig::RecallPreset(rig, preset, std::move(done)); };
  lens.Ask<rig::RecallOutcome>(recall, [exchange, &lens](const Result<rig::RecallOutcome>& outcome) {
    if (!outcome) return Refuse(exchange, lens, outcome.error());
    Json json = BroughtBack(lens.name(), *outcome);
    json["label"] = LabelOf(exchange);
    json["reached"] = outcome->reached;
    lens.watchers().AnnounceMoves(lens, json["moves"]);
    exchange->Finish(varlink::WriteJson({{"recall", json}}));
  });
}

void Remove(ServedLens& lens, const ExchangePointer& exchange) {
  const rig::Preset* const preset = Find(lens, exchange);
  if (preset == nullptr) return;
  const auto remove = [label = preset->label](std::vector<rig::Preset>& presets) -> Result<void> {
    std::erase_if(presets, [&](const rig::Preset& old) { return old.label == label; });
    return {};
  };
  lens.ChangePresets(remove, [&lens, exchange, label = preset->label](const Result<void>& kept) {
    if (!kept) return Refuse(exchange, lens, kept.error());
    exchange->Finish("{}");
    lens.watchers().Announce(lens, "preset", {{"change", "removed"}, {"label", label}});
  });
}

void Undo(ServedLens& lens, const ExchangePointer& exchange) {
  const auto undo = [&history = lens.users().history](rig::Rig& rig, auto done) {
    if (const auto before = history.Before(rig)) return rig::RecallPreset(rig, *before, std::move(done));
    done(rig::RecallOutcome{
        .moves = {},
        .reached = false,
        .vergence_bound = {},
        .native_bound = {},
        .remark = "there is nothing to undo: no command has moved this lens since lensd started, or since somebody "
                  "said where it stands"});
  };
  lens.Ask<rig::RecallOutcome>(undo, [exchange, &lens](const Result<rig::RecallOutcome>& outcome) {
    if (!outcome) return Refuse(exchange, lens, outcome.error());
    Json json = BroughtBack(lens.name(), *outcome);
    json["undone"] = outcome->reached;
    lens.watchers().AnnounceMoves(lens, json["moves"]);
    exchange->Finish(varlink::WriteJson({{"undo", json}}));
  });
}

}  // namespace

MethodTable PresetMethods(LensService& service) {
  return {{"PresetSave", service.ForLens(Save)},
          {"PresetList", service.ForLens(List)},
          {"PresetRecall", service.ForLens(Recall)},
          {"PresetRemove", service.ForLens(Remove)},
          {"Undo", service.ForLens(Undo)}};
}

}  // namespace lensd::daemon
