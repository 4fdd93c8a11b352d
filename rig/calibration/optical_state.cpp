// What positions mean, and with which bound: the calibration in force, and the table it makes under the temperature,
// the zoom and the filter of the moment. A bound is what the function does to the ends of the position's own bound, and
// the table's own error besides.
#include "rig/calibration/optical_state.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/missing_optics.h"
#include "optics/conjugates.h"

namespace lensd::rig {
namespace {

using drivers::Axis;

Result<void> CheckSerial(const Calibration& calibration, const drivers::Capabilities& lens) {
  if (lens.serial.empty() || lens.serial == calibration.serial) return {};
  const std::string whose = calibration.serial.empty() ? "names no serial number" : "is of " + calibration.serial;
  return Fail(Code::InvalidArgument, "the calibration " + whose + ", and this lens is " + lens.serial);
}

/// The largest distance of a function's values at either end of an interval from that at its middle.
template <class Quantity>
Quantity Reach(Quantity middle, Quantity one_end, Quantity other_end) {
  return Quantity{std::max(std::abs((one_end - middle).value), std::abs((other_end - middle).value))};
}

}  // namespace

Result<std::optional<OpticsTable>> OpticalState::TableFor(const RigConfig& config, const drivers::Device& device,
                                                          std::shared_ptr<const Calibration> calibration) {
  if (calibration) {
    if (auto same = CheckSerial(*calibration, device.lens->capabilities()); !same) return PassOn(same);
  }
  const auto& known = config.optics ? config.optics : device.optics;
  if (!known && calibration && !calibration->focus.empty()) {
    return Fail(Code::InvalidArgument,
                std::string("a calibration of focus needs the optics beside it: ") + kConfigureOptics);
  }
  if (!known) return std::nullopt;
  auto made = OpticsTable::Create(*known, device.lens->capabilities(), config, std::move(calibration));
  if (!made) return PassOn(made);
  return *std::move(made);
}

OpticalState::OpticalState(RigConfig config, const AxisControllers& axes, std::optional<OpticsTable> table,
                           std::shared_ptr<const Calibration> calibration)
    : config_(std::move(config)), axes_(axes), table_(std::move(table)), calibration_(std::move(calibration)) {
  AdoptBacklash();
  AdoptDirection();
}

void OpticalState::AdoptDirection() {
  AxisController* const focus = axes_[Axis::Focus].get();
  if (focus == nullptr) return;
  focus->SetDirection(DirectionOf(config_.axes[Axis::Focus], focus->setup().can, calibration_.get()));
}

/// What the configuration leaves to be found out. The take-up is the most it can be.
void OpticalState::AdoptBacklash() {
  for (const Axis axis : drivers::kAxes) {
    if (!axes_[axis] || config_.axes[axis].backlash) continue;
    std::optional<double> backlash;
    if (calibration_ && calibration_->backlash[axis]) backlash = std::ceil(calibration_->backlash[axis]->high);
    axes_[axis]->SetBacklash(backlash);
  }
}

void OpticalState::Adopt(std::optional<OpticsTable> table, std::shared_ptr<const Calibration> calibration) {
  table_ = std::move(table);
  shared_table_ = nullptr;
  held_.reset();
  calibration_ = std::move(calibration);
  AdoptBacklash();
  AdoptDirection();
}

void OpticalState::Adopt(std::optional<OpticsTable> table, std::optional<drivers::Direction> seen) {
  config_.axes[Axis::Focus].seen = seen;
  Adopt(std::move(table), calibration_);
}

void OpticalState::NoteConditions(std::optional<Celsius> temperature) {
  if (!table_) return;
  const auto position = [&](Axis axis) -> std::optional<Native> {
    if (!axes_[axis] || !axes_[axis]->state()) return std::nullopt;
    return axes_[axis]->state()->position;
  };
  Conditions now;
  if (const auto zoom = position(Axis::Zoom)) now.zoom = *zoom;
  if (const auto filter = position(Axis::Filter)) now.filter = *filter;
  if (temperature) now.temperature = kTemperatureStep * std::round(*temperature / kTemperatureStep);
  if (shared_table_ && now == table_->conditions()) return;
  OpticsTable next = table_->In(now);
  if (held_ && now.temperature && !table_->conditions().temperature) {
    // Focus was brought here without that: to know it is no change of it.
    held_ = next.ExtensionFromNative(table_->NativeFromExtension(*held_));
  }
  table_ = std::move(next);
  shared_table_ = std::make_shared<const OpticsTable>(*table_);
}

Backlash OpticalState::BacklashOf(Axis axis) const {
  if (const auto& said = config_.axes[axis].backlash) return {*said, *said, *said, false};
  if (calibration_ && calibration_->backlash[axis]) return *calibration_->backlash[axis];
  return {};
}

bool OpticalState::Compensates() const {
  const TemperatureConfig& temperature = config_.temperature;
  return temperature.compensate && (temperature.metres_per_degree || (calibration_ && calibration_->temperature));
}

std::optional<Native> OpticalState::Drifted() const {
  if (!held_ || focus_table() == nullptr || !Compensates() || !axes_[Axis::Focus]) return {};
  const auto target = axes_[Axis::Focus]->target();
  const AxisSetup& focus = axes_[Axis::Focus]->setup();
  const Native wanted = std::clamp(table_->NativeFromExtension(*held_), focus.minimum, focus.maximum);
  if (!target || std::abs((wanted - *target).value) < config_.temperature.minimum_move) return std::nullopt;
  return wanted;
}

// ---- from the picture to positions --------------------------------------------------------------------------------

Result<Native> OpticalState::Aim(Axis axis, const Target& target) const {
  using Kind = Target::Kind;
  if (target.kind == Kind::FNumber) {
    if (axis != Axis::Iris) return Fail(Code::InvalidArgument, "only the iris has an f-number");
    if (!(target.value > 0)) return Fail(Code::InvalidArgument, "an f-number must be above 0");
    if (!table_ || !table_->has_iris()) return Fail(Code::Unsupported, OpticsMissing("this lens' f-numbers are"));
    return table_->NativeFromFNumber(FNumber{target.value});
  }
  if (target.kind == Kind::FocalLength) {
    if (axis != Axis::Zoom) return Fail(Code::InvalidArgument, "only the zoom can be set to a focal length");
    if (!(target.value > 0)) return Fail(Code::InvalidArgument, "a focal length must be above 0");
    if (!table_ || !table_->has_zoom()) return Fail(Code::Unsupported, OpticsMissing("this lens' focal lengths are"));
    return table_->NativeFromFocalLength(Metres{target.value});
  }
  if (axis != Axis::Focus) return Fail(Code::InvalidArgument, "only focus can be set to a distance");
  if (table_ && LacksDirection(*table_)) return PassOn(DirectionUnknown("focus cannot be set to a distance"));
  if (!table_ || !table_->has_focus()) {
    return Fail(Code::Unsupported,
                OpticsMissing("only native positions are possible, such as @1200: this lens' optics are"));
  }
  auto extension = ExtensionOf(target);
  if (!extension) return PassOn(extension);
  return table_->NativeFromExtension(*extension);
}

Result<Metres> OpticalState::ExtensionOf(const Target& target) const {
  if (target.kind == Target::Kind::Extension) return Metres{target.value};
  if (target.kind == Target::Kind::Vergence) return table_->ExtensionInFocus(Dioptres{target.value});
  const optics::FocusScale scale = ScaleOf(target);
  // A liquid lens' sensor stands where it stands, whatever is in focus.
  auto depth = table_->nominal().liquid
                   ? optics::DepthAt(scale, table_->focal_length(), Metres{0.0}, Metres{target.value})
                   : optics::DepthInFocus(scale, table_->focal_length(), Metres{target.value});
  if (!depth) return PassOn(depth);
  return table_->ExtensionInFocus(*depth);
}

optics::FocusScale OpticalState::ScaleOf(const Target& target) const {
  optics::FocusScale scale = config_.scale;
  scale.centre_shift = table_->centre_shift();
  if (target.from) scale.from = *target.from;
  return scale;
}

/// At both ends of focus: extensions in mm, vergences in dioptres or distances in metres, where infinity and what lies
/// past it is infinite.
std::pair<double, double> OpticalState::ReachOfFocus(const Target& target, Native low, Native high) const {
  const auto at = [&](Native end) {
    const Metres extension = table_->ExtensionFromNative(end);
    if (target.kind == Target::Kind::Extension) return extension.value * 1e3;
    const double vergence = table_->VergenceFromExtension(extension).value;
    if (target.kind == Target::Kind::Vergence) return vergence;
    if (!(vergence > 0.0)) return std::numeric_limits<double>::infinity();
    const Metres stands = table_->nominal().liquid ? Metres{0.0} : extension;
    return optics::DistanceShown(ScaleOf(target), table_->focal_length(), stands, Metres{1.0 / vergence}).value;
  };
  return std::minmax({at(low), at(high)});
}

ErrorFacts OpticalState::ReachOf(Axis axis, const Target& target) const {
  using Kind = Target::Kind;
  const AxisSetup& setup = axes_[axis]->setup();
  const Native low = setup.minimum, high = setup.maximum;
  std::pair<double, double> reach{low.value, high.value};
  const bool f_numbers = setup.can.unit == drivers::NativeUnit::FNumber || target.kind == Kind::FNumber;
  std::string unit(f_numbers ? "fNumber" : drivers::NativeUnitName(setup.can.unit));
  if (target.kind == Kind::NativeRelative || target.kind == Kind::TowardNear) {
    const double sign = target.kind == Kind::TowardNear && !setup.direction.near_positive() ? -1.0 : 1.0;
    const double stands = axes_[axis]->Ahead(0.0).value_or(Native{}).value;
    reach = std::minmax({sign * (low.value - stands), sign * (high.value - stands)});
  } else if (target.kind == Kind::FNumber) {
    reach = std::minmax({table_->FNumberFromNative(low).value, table_->FNumberFromNative(high).value});
  } else if (target.kind == Kind::FocalLength) {
    reach =
        std::minmax({1e3 * table_->FocalLengthFromNative(low).value, 1e3 * table_->FocalLengthFromNative(high).value});
    unit = "mm";
  } else if (target.kind != Kind::Native) {
    reach = ReachOfFocus(target, low, high);
    unit = target.kind == Kind::Extension ? "mm" : target.kind == Kind::Vergence ? "D" : "m";
  }
  ErrorFacts facts{.axis = std::string(drivers::AxisName(axis)), .unit = std::move(unit)};
  if (std::isfinite(reach.first)) facts.minimum = reach.first;
  if (std::isfinite(reach.second)) facts.maximum = reach.second;
  return facts;
}

std::optional<FNumber> OpticalState::f_number() const {
  if (!table_) return std::nullopt;
  if (!table_->has_iris()) return table_->fixed_f_number();
  const AxisController* iris = axes_[Axis::Iris].get();
  if (iris == nullptr || Lost(Axis::Iris)) return std::nullopt;
  if (iris->motion() != nullptr && iris->target()) return table_->FNumberFromNative(*iris->target());
  if (!iris->state()) return std::nullopt;
  return table_->FNumberFromNative(iris->state()->position);
}

// ---- from positions to the picture --------------------------------------------------------------------------------

/// Nothing where there is no such axis, or its position means nothing.
const AxisController* OpticalState::Known(Axis axis) const {
  return axes_[axis] && axes_[axis]->known() ? axes_[axis].get() : nullptr;
}

/// What its positions mean hangs on where others stand, too.
bool OpticalState::Lost(Axis axis) const {
  const auto lost = [&](Axis one) { return axes_[one] && axes_[one]->track().lost(); };
  return lost(axis) || (axis == Axis::Focus && (lost(Axis::Zoom) || lost(Axis::Filter)));
}

const OpticsTable* OpticalState::focus_table() const {
  return table_ && table_->has_focus() && !Lost(Axis::Focus) ? &*table_ : nullptr;
}

Metres OpticalState::ExtensionBound(Native here, Native bound) const {
  return Reach(table_->ExtensionFromNative(here), table_->ExtensionFromNative(here - bound),
               table_->ExtensionFromNative(here + bound)) +
         table_->ExtensionError(here);
}

FNumber OpticalState::FNumberBound(Native here, Native bound) const {
  const FNumber middle = table_->FNumberFromNative(here);
  return Reach(middle, table_->FNumberFromNative(here - bound), table_->FNumberFromNative(here + bound)) +
         middle * table_->FNumberError();
}

void OpticalState::Describe(MoveOutcome& outcome) const {
  if (!table_ || Lost(outcome.axis)) return;
  const Native here = outcome.position, low = here - outcome.bound, high = here + outcome.bound;
  if (outcome.axis == Axis::Focus && table_->has_focus()) {
    const Metres at_low = table_->ExtensionFromNative(low), at_high = table_->ExtensionFromNative(high);
    outcome.extension = table_->ExtensionFromNative(here);
    outcome.extension_bound = ExtensionBound(here, outcome.bound);
    outcome.vergence = table_->VergenceFromExtension(*outcome.extension);
    outcome.vergence_bound =
        Reach(*outcome.vergence, table_->VergenceFromExtension(at_low), table_->VergenceFromExtension(at_high)) +
        table_->VergenceError(here);
  }
  if (outcome.axis == Axis::Iris && table_->has_iris()) {
    outcome.f_number = table_->FNumberFromNative(here);
    outcome.f_number_bound = FNumberBound(here, outcome.bound);
  }
  if (outcome.axis == Axis::Zoom && table_->has_zoom()) {
    outcome.focal_length = table_->FocalLengthFromNative(here);
    outcome.focal_length_bound =
        Reach(*outcome.focal_length, table_->FocalLengthFromNative(low), table_->FocalLengthFromNative(high)) +
        *outcome.focal_length * table_->FocalLengthError();
  }
}

void OpticalState::Describe(LensedFrame& frame) const {
  if (!table_) return;
  const auto middle = [&](Axis axis) { return 0.5 * (frame.axes[axis]->lowest + frame.axes[axis]->highest); };
  const auto& focus = frame.axes[Axis::Focus];
  if (focus_table() != nullptr && focus && Known(Axis::Focus)) {
    frame.extension = table_->ExtensionFromNative(middle(Axis::Focus));
    frame.extension_bound = ExtensionBound(middle(Axis::Focus), focus->bound);
  }
  if (table_->has_iris()) {
    if (!frame.axes[Axis::Iris] || !Known(Axis::Iris)) return;
    frame.f_number = table_->FNumberFromNative(middle(Axis::Iris));
    frame.f_number_bound = FNumberBound(middle(Axis::Iris), frame.axes[Axis::Iris]->bound);
  } else if (table_->fixed_f_number()) {
    frame.f_number = table_->fixed_f_number();
    frame.f_number_bound = FNumber{};
  }
}

void OpticalState::Describe(Status& status, bool problem) const {
  if (!table_) return;
  status.optics = shared_table_;
  status.compensates = Compensates();
  if (problem) return;
  if (!Lost(Axis::Zoom)) status.focal_length = table_->focal_length();
  if (focus_table() != nullptr && status.axes[Axis::Focus] && Known(Axis::Focus)) {
    const Native focus = status.axes[Axis::Focus]->position;
    status.extension = table_->ExtensionFromNative(focus);
    status.vergence = table_->VergenceFromExtension(*status.extension);
    status.focal_length = table_->FocalLengthAt(*status.extension);
    status.grade = table_->GradeAt(focus);
    if (status.grade != Grade::Uncalibrated) status.extension_error = table_->ExtensionError(focus);
  }
  if (table_->has_iris() && status.axes[Axis::Iris]) {
    if (Known(Axis::Iris)) status.f_number = table_->FNumberFromNative(status.axes[Axis::Iris]->position);
  } else {
    status.f_number = table_->fixed_f_number();
  }
  DescribeBounds(status);
}

/// Of what stands: an axis' bound says nothing while it moves.
void OpticalState::DescribeBounds(Status& status) const {
  const auto& focus = status.axes[Axis::Focus];
  if (status.vergence && focus && !focus->moving) {
    const auto there = [&](Native end) {  // it is not beyond its travel
      const Native within = std::clamp(end, focus->minimum, focus->maximum);
      return table_->VergenceFromExtension(table_->ExtensionFromNative(within));
    };
    status.vergence_bound =
        Reach(*status.vergence, there(focus->position - focus->bound), there(focus->position + focus->bound)) +
        table_->VergenceError(focus->position);
  }
  const auto& iris = status.axes[Axis::Iris];
  if (!status.f_number || (table_->has_iris() && iris && iris->moving)) return;
  status.f_number_bound = table_->has_iris() && iris ? FNumberBound(iris->position, iris->bound) : FNumber{0.0};
}

}  // namespace lensd::rig
