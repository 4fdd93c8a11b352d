// Presets: saved, listed, recalled and removed.
#include <algorithm>
#include <ctime>
#include <utility>

#include "calibration_store.h"
#include "lens_entry.h"
#include "lens_json.h"
#include "lens_service.h"
#include "rig/presets.h"

namespace lensd::daemon {
namespace {

using proto::Json;

constexpr std::size_t kMostPresets = 1000;

std::string Now() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc)};
}

const rig::Preset* Find(const std::vector<rig::Preset>& presets, const std::string& label) {
  const auto found = std::ranges::find(presets, label, &rig::Preset::label);
  return found == presets.end() ? nullptr : &*found;
}

void RefuseUnknown(const ExchangePointer& exchange, const std::vector<rig::Preset>& presets, const std::string& label) {
  std::string names;
  for (const rig::Preset& preset : presets) names += (names.empty() ? "" : ", ") + preset.label;
  exchange->Refuse("io.lensd.Lens.PresetNotFound",
                   {{"message", "there is no preset \"" + label + "\"; " +
                                    (names.empty() ? "none is saved" : "there is " + names)}});
}

Json RecallJson(const std::string& lens, const std::string& label, const rig::RecallOutcome& outcome) {
  Json moves = Json::array();
  for (const rig::MoveOutcome& move : outcome.moves) moves.push_back(MoveJson(lens, move));
  const auto number = [](const auto& value) { return value ? proto::NumberOrNull(value->value) : Json(nullptr); };
  return {{"lens", lens},
          {"label", label},
          {"reached", outcome.reached},
          {"vergenceBoundD", number(outcome.vergence_bound)},
          {"bound", number(outcome.native_bound)},
          {"moves", std::move(moves)},
          {"remark", outcome.remark}};
}

}  // namespace

/// A file that cannot be read is never written over.
Result<void> LensService::KeepPresets(Lens& lens, std::vector<rig::Preset> presets) {
  if (!lens.presets_broken.empty()) return Fail(Code::Io, "presets cannot be kept: " + lens.presets_broken);
  std::ranges::sort(presets, {}, &rig::Preset::label);
  if (auto kept = Keep(lens.presets_file, rig::PresetsText(presets)); !kept) return kept;
  lens.presets = std::move(presets);
  return {};
}

void LensService::PresetSave(const ExchangePointer& exchange) {
  Lens* const lens = FindLens(exchange);
  if (lens == nullptr) return;
  auto answer = [this, exchange, lens](Result<rig::Preset> taken) {
    if (!taken) return Refuse(exchange, taken.error());
    taken->saved = Now();
    std::vector<rig::Preset> presets = lens->presets;
    std::erase_if(presets, [&](const rig::Preset& old) { return old.label == taken->label; });
    if (presets.size() >= kMostPresets) {
      return Refuse(exchange, {Code::OutOfRange, "1000 presets are saved already: remove some"});
    }
    presets.push_back(*taken);
    if (auto kept = KeepPresets(*lens, std::move(presets)); !kept) return Refuse(exchange, kept.error());
    exchange->Finish(proto::WriteJson({{"preset", PresetJson(*taken)}}));
  };
  lens->worker->Submit([lens, answer, label = exchange->parameters()["label"].get<std::string>()](rig::Rig& rig) {
    lens->worker->Later([answer, taken = rig::TakePreset(rig, label)] { answer(taken); });
  });
}

void LensService::PresetList(const ExchangePointer& exchange) {
  Lens* const lens = FindLens(exchange);
  if (lens == nullptr) return;
  if (!lens->presets_broken.empty()) return Refuse(exchange, {Code::Io, lens->presets_broken});
  Json presets = Json::array();
  for (const rig::Preset& preset : lens->presets) presets.push_back(PresetJson(preset));
  exchange->Finish(proto::WriteJson({{"presets", std::move(presets)}}));
}

void LensService::PresetRecall(const ExchangePointer& exchange) {
  Lens* const lens = FindLens(exchange);
  if (lens == nullptr) return;
  const std::string label = exchange->parameters()["label"].get<std::string>();
  const rig::Preset* preset = Find(lens->presets, label);
  if (preset == nullptr) return RefuseUnknown(exchange, lens->presets, label);
  auto answer = [this, exchange, lens, label](const Result<rig::RecallOutcome>& outcome) {
    if (!outcome) return Refuse(exchange, outcome.error());
    const Json recall = RecallJson(lens->name, label, *outcome);
    AnnounceMoves(*lens, recall["moves"]);
    exchange->Finish(proto::WriteJson({{"recall", recall}}));
  };
  lens->worker->Submit([lens, answer, preset = *preset](rig::Rig& rig) {
    rig::RecallPreset(rig, preset, [lens, answer](Result<rig::RecallOutcome> outcome) {
      lens->worker->Later([answer, outcome = std::move(outcome)] { answer(outcome); });
    });
  });
}

void LensService::PresetRemove(const ExchangePointer& exchange) {
  Lens* const lens = FindLens(exchange);
  if (lens == nullptr) return;
  const std::string label = exchange->parameters()["label"].get<std::string>();
  if (Find(lens->presets, label) == nullptr) return RefuseUnknown(exchange, lens->presets, label);
  std::vector<rig::Preset> presets = lens->presets;
  std::erase_if(presets, [&](const rig::Preset& old) { return old.label == label; });
  if (auto kept = KeepPresets(*lens, std::move(presets)); !kept) return Refuse(exchange, kept.error());
  exchange->Finish("{}");
}

}  // namespace lensd::daemon
