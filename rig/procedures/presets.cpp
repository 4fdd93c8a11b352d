// Taking, keeping and recalling a place. A recall is a chain of moves, each begun when the one before has ended;
// another command given meanwhile ends it.
#include "rig/presets.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <memory>
#include <utility>

#include "rig/common/toml_number.h"
#include "rig/procedures/command_guard.h"

namespace lensd::rig {
namespace {

using drivers::Axis;

constexpr std::string_view kNativeKeys[] = {"focus_steps", "iris_steps", "zoom_steps", "filter"};
constexpr std::size_t kLongestLabel = 64;

template <class Unit>
void Write(std::string& text, std::string_view key, const std::optional<Quantity<Unit>>& value, double unit = 1.0) {
  if (value) text += std::string(key) + " = " + NumberText(value->value / unit) + "\n";
}

template <class Unit>
void Read(SettingsReader& read, std::string_view key, std::optional<Quantity<Unit>>& value, double unit = 1.0,
          Range range = {}) {
  if (const auto number = read.OptionalNumber(key, range)) value = Quantity<Unit>{*number * unit};
}

Result<Preset> ReadPreset(const Settings& table) {
  SettingsReader read(table, "[[preset]]");
  Preset preset;
  preset.label = read.RequiredText("label");
  if (!IsPresetLabel(preset.label)) read.Reject("label", "has letters, digits, '-', '_', '.' and spaces, at most 64");
  preset.saved = read.Text("saved", "");
  preset.approach_up = read.Choice("approach", {"up", "down"}, 0) == 0;
  for (const Axis axis : drivers::kAxes) Read(read, kNativeKeys[static_cast<std::size_t>(axis)], preset.native[axis]);
  Read(read, "temperature_c", preset.temperature);
  Read(read, "vergence_d", preset.vergence);
  Read(read, "vergence_bound_d", preset.vergence_bound, 1.0, kNonNegative);
  Read(read, "extension_mm", preset.extension, 1e-3);
  Read(read, "f_number", preset.f_number, 1.0, kPositive);
  Read(read, "focal_length_mm", preset.focal_length, 1e-3, kPositive);
  preset.grade = static_cast<Grade>(read.Choice("grade", {"uncalibrated", "approximate", "calibrated"}, 0));
  if (auto done = read.Finish(); !done) return PassOn(done);
  return preset;
}

/// Axes one after the other, focus last: what its positions mean depends on the others.
class RecallRun : public std::enable_shared_from_this<RecallRun> {
 public:
  using Done = std::move_only_function<void(Result<RecallOutcome>)>;
  RecallRun(Rig& rig, const Preset& preset, Done done)
      : rig_(rig), guard_(rig), preset_(preset), done_(std::move(done)) {}

  /// Before any axis moves: where one stands that is not known, none of it leads back.
  void Begin() {
    const Status status = rig_.GetStatus();
    for (const Axis axis : kOrder) {
      if (!Moves(axis)) continue;
      if (auto lost = WhyLost(axis, status.axes[axis])) return done_(PassOn(*std::move(lost)));
    }
    Next();
  }

  void Next() {
    while (step_ < std::size(kOrder)) {
      const Axis axis = kOrder[step_++];
      if (!Moves(axis)) continue;
      return guard_.Move(axis, TargetOf(axis), [self = shared_from_this()](Result<MoveOutcome> moved) {
        if (!moved) return self->done_(self->HowFar(moved.error()));
        self->outcome_.moves.push_back(*moved);
        self->Next();
      });
    }
    Finish();
  }

 private:
  static constexpr Axis kOrder[] = {Axis::Zoom, Axis::Filter, Axis::Iris, Axis::Focus};

  bool Moves(Axis axis) const { return preset_.native[axis] && rig_.lens().axes[axis]; }

  /// With which axes have arrived, and which have not.
  std::unexpected<Error> HowFar(Error error) const {
    std::string there, not_there;
    for (const Axis axis : kOrder) {
      if (!Moves(axis)) continue;
      std::string& names = std::ranges::count(outcome_.moves, axis, &MoveOutcome::axis) > 0 ? there : not_there;
      names += (names.empty() ? "" : ", ") + std::string(AxisName(axis));
    }
    error.message += (there.empty() ? "" : "; arrived: " + there) + "; not arrived: " + not_there;
    return PassOn(std::move(error));
  }

  Target TargetOf(Axis axis) {
    Target target{.kind = Target::Kind::Native, .value = preset_.native[axis]->value, .from = {}, .take_up = {}};
    const OpticsTable* optics = rig_.optics();
    const auto take = [&](Target::Kind kind, double value) {
      target.kind = kind;
      target.value = value;
    };
    if (axis == Axis::Zoom && preset_.focal_length && optics && optics->has_zoom()) {
      // Breathing is not the zoom's: its focal length is the one at extension 0.
      take(Target::Kind::FocalLength, preset_.focal_length->value);
    }
    if (axis == Axis::Iris && preset_.f_number && optics && optics->has_iris()) {
      take(Target::Kind::FNumber, preset_.f_number->value);
    }
    if (axis != Axis::Focus) return target;
    if (preset_.vergence && optics && optics->has_focus()) {
      take(Target::Kind::Vergence, preset_.vergence->value);
    } else if (rig_.approaches_up(axis) != preset_.approach_up) {
      // The mechanism lags behind the count by half the backlash on either side.
      const Backlash backlash = rig_.backlash(axis);
      target.value += rig_.approaches_up(axis) ? backlash.steps : -backlash.steps;
      unsure_ = std::max(backlash.high - backlash.steps, backlash.steps - backlash.low);
      outcome_.remark = backlash.high > 0.0
                            ? "focus is approached from the other side than when this was saved: moved by the backlash"
                            : "focus is approached from the other side than when this was saved, and its backlash is "
                              "not known: it may be off by as much";
    }
    return target;
  }

  void Finish() {
    outcome_.reached = std::ranges::all_of(outcome_.moves, &MoveOutcome::reached);
    for (const MoveOutcome& move : outcome_.moves) {
      if (move.axis != Axis::Focus) continue;
      if (preset_.vergence && move.vergence && move.vergence_bound) {
        // Both stand within their bounds, and the target lies within half a step of where it was sent.
        outcome_.vergence_bound = Dioptres{std::abs((*move.vergence - *preset_.vergence).value)} +
                                  *move.vergence_bound + preset_.vergence_bound.value_or(Dioptres{0.0});
      } else {
        const double off = std::abs((move.position - *preset_.native[Axis::Focus]).value);
        const double meant = std::abs(
            rig_.approaches_up(Axis::Focus) != preset_.approach_up ? off - rig_.backlash(Axis::Focus).steps : off);
        outcome_.native_bound = Native{meant + unsure_} + 2.0 * move.bound;
      }
    }
    done_(std::move(outcome_));
  }

  Rig& rig_;
  CommandGuard guard_;
  Preset preset_;
  Done done_;
  std::size_t step_ = 0;
  double unsure_ = 0.0;
  RecallOutcome outcome_;
};

}  // namespace

bool IsPresetLabel(std::string_view label) {
  const auto plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_' || c == '.';
  };
  if (label.empty() || label.size() > kLongestLabel || !plain(label.front()) || !plain(label.back())) return false;
  return std::ranges::all_of(label, [&](char c) { return plain(c) || c == ' '; });
}

Result<Preset> TakePreset(const Rig& rig, std::string label) {
  if (!IsPresetLabel(label)) {
    return Fail(Code::InvalidArgument,
                "a label has letters (a to z, A to Z), digits, '-', '_', '.' and spaces inside, at most 64",
                {.parameter = "label"});
  }
  const Status status = rig.GetStatus();
  if (!status.connected) return Fail(Code::Disconnected, "the lens does not answer: " + status.problem);
  if (auto moving = rig.WhyNotAtRest()) return PassOn(*std::move(moving));
  Preset preset;
  preset.label = std::move(label);
  preset.temperature = status.temperature;
  preset.approach_up = rig.approaches_up(Axis::Focus);
  for (const Axis axis : drivers::kAxes) {
    if (!status.axes[axis]) continue;
    if (auto lost = WhyLost(axis, status.axes[axis])) return PassOn(*std::move(lost));
    if (!status.axes[axis]->homed && rig.lens().axes[axis]->can_home) {
      return Fail(Code::NotHomed, "where " + std::string(AxisName(axis)) +
                                      " stands is not known, so a preset would lead elsewhere: home it first");
    }
    preset.native[axis] = status.axes[axis]->position;
  }
  preset.vergence = status.vergence;
  preset.extension = status.extension;
  preset.f_number = status.f_number;
  preset.grade = status.grade;
  preset.vergence_bound = status.vergence_bound;
  if (status.optics) preset.focal_length = status.optics->focal_length();
  return preset;
}

Result<std::vector<Preset>> ReadPresets(const Settings& file) {
  SettingsReader read(file, "the presets");
  if (!read.Has("version")) read.Reject("version", "the file must say version = 1");
  if (read.Integer("version", 1) != 1) read.Reject("version", "must be 1: this lensd reads version 1 alone");
  const auto tables = read.Tables("preset");
  if (auto done = read.Finish(); !done) return PassOn(done);
  std::vector<Preset> presets;
  for (const Settings* table : tables) {
    auto preset = ReadPreset(*table);
    if (!preset) return PassOn(preset);
    if (std::ranges::find(presets, preset->label, &Preset::label) != presets.end()) {
      return Fail(Code::BadData, table->where().Text() + ": there is another preset \"" + preset->label + "\"");
    }
    presets.push_back(*std::move(preset));
  }
  return presets;
}

std::string PresetsText(const std::vector<Preset>& presets) {
  std::string text =
      "# Presets of one lens, written by lensd; lensctl preset shows, recalls and removes them.\nversion = 1\n";
  for (const Preset& preset : presets) {
    text += "\n[[preset]]\nlabel = \"" + preset.label + "\"\n";
    if (!preset.saved.empty()) text += "saved = \"" + preset.saved + "\"\n";
    text += std::string("approach = ") + (preset.approach_up ? "\"up\"\n" : "\"down\"\n");
    for (const Axis axis : drivers::kAxes)
      Write(text, kNativeKeys[static_cast<std::size_t>(axis)], preset.native[axis]);
    Write(text, "temperature_c", preset.temperature);
    Write(text, "vergence_d", preset.vergence);
    Write(text, "vergence_bound_d", preset.vergence_bound);
    Write(text, "extension_mm", preset.extension, 1e-3);
    Write(text, "f_number", preset.f_number);
    Write(text, "focal_length_mm", preset.focal_length, 1e-3);
    text += "grade = \"" + std::string(GradeName(preset.grade)) + "\"\n";
  }
  return text;
}

void RecallPreset(Rig& rig, const Preset& preset, std::move_only_function<void(Result<RecallOutcome>)> done) {
  std::make_shared<RecallRun>(rig, preset, std::move(done))->Begin();
}

}  // namespace lensd::rig
