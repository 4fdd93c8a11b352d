// Motors, scripted faults and the optics that follow from where the mechanism truly stands. Counts and truth are kept
// apart throughout.
#include "sim/mechanics/mechanics.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sim/camera/colour_focus.h"
#include "sim/render/pupil.h"

namespace lensd::sim {
namespace {

using drivers::Axis;

// Iris and zoom have no speeds of their own in a scene: a full sweep takes about this long.
constexpr double kIrisSweep_s = 0.25;
constexpr double kZoomSweep_s = 1.0;
constexpr double kFilter_s = 0.2;       // from one place of the wheel to the next
constexpr double kSpeedUp_s = 0.02;     // to full speed
constexpr double kZoomPlaces = 1000.0;  // between the ends of the zoom range
constexpr double kSettlingTimes = 5.0;  // time constants of creep in settle_ms: 0.7 % is left after it
constexpr double kCalibration_c = 20.0;

/// m by which best focus in the middle of the truth region lies farther behind the lens than green's in the middle of
/// the frame: blur's mean square is smallest at the mean of what the colours need.
double FocusOffOf(const Scene& scene) {
  const double diagonal = std::hypot(scene.camera.width, scene.camera.height);
  const auto off_middle = [&](double low, double size, int px) { return (2.0 * low + size - 1.0) * px / diagonal; };
  const Region& region = scene.truth_region;
  double off_m = FocusOffM(scene.lens, {off_middle(region.x, region.w, scene.camera.width),
                                        off_middle(region.y, region.h, scene.camera.height)});
  for (const ColourShare& colour : ColoursSeen(scene, Channel::Luminance)) off_m += colour.share * colour.extension_m;
  return off_m;
}

drivers::AxisCapabilities AxisOver(const LensSettings& lens, drivers::NativeUnit unit, double low, double high,
                                   double resolution) {
  drivers::AxisCapabilities axis;
  axis.feedback = lens.feedback;
  axis.unit = unit;
  axis.minimum = Native{low};
  axis.maximum = Native{high};
  axis.resolution = resolution;
  axis.can_home = lens.reference;
  // What a controller counts goes on below 0, and beyond the travel.
  if (!lens.reference) axis.counts = {Native{low - (high - low)}, Native{high + (high - low)}};
  return axis;
}

MotorSettings SweepMotor(double low, double high, double sweep_s) {
  MotorSettings motor;
  motor.low = low;
  motor.high = high;
  motor.top_speed = (high - low) / sweep_s;
  motor.acceleration = motor.top_speed / kSpeedUp_s;
  return motor;
}

MotorSettings FocusMotor(const LensSettings& lens) {
  MotorSettings motor;
  motor.high = lens.steps - 1.0;
  motor.top_speed = lens.speed_steps_per_s;
  motor.acceleration = lens.acceleration_steps_per_s2;
  motor.backlash = lens.backlash_steps;
  motor.creep_s = lens.settle_ms * 1e-3 / kSettlingTimes;
  motor.ring_hz = lens.ring_hz;
  motor.ring_damping = lens.ring_damping;
  return motor;
}

MotorSettings IrisMotor(const LensSettings& lens) {
  MotorSettings motor = SweepMotor(0.0, lens.iris_steps - 1.0, kIrisSweep_s);
  motor.backlash = lens.iris_backlash_steps;
  return motor;
}

/// Even in extension along the axis; of a liquid lens even in power.
double ExtensionAlong(const LensSettings& lens, double along) {
  if (!lens.liquid) {
    return 1e-3 * (lens.min_extension_mm + along * (lens.max_extension_mm - lens.min_extension_mm));
  }
  const double sensor_m = 1e-3 * lens.min_focal_length_mm;
  const double low_d = 1.0 / (sensor_m - 1e-3 * lens.min_extension_mm);
  const double high_d = 1.0 / (sensor_m - 1e-3 * lens.max_extension_mm);
  return sensor_m - 1.0 / (low_d + along * (high_d - low_d));
}

double IrisPlace(const LensSettings& lens, double f_number) {
  return (lens.iris_steps - 1.0) * std::log(f_number / lens.min_f_number) /
         std::log(lens.max_f_number / lens.min_f_number);
}

}  // namespace

drivers::Capabilities CapabilitiesOf(const LensSettings& lens) {
  using drivers::NativeUnit;
  static constexpr const char* kModels[] = {"simulated pinhole", "simulated aperture", "simulated thin lens"};
  drivers::Capabilities capabilities;
  capabilities.driver = "sim";
  capabilities.model = kModels[static_cast<std::size_t>(lens.model)];
  capabilities.axes[Axis::Focus] = AxisOver(lens, NativeUnit::Steps, 0.0, lens.steps - 1.0, 1.0);
  capabilities.axes[Axis::Focus]->direction = {drivers::Direction::NearPositive, "the simulated lens"};
  capabilities.axes[Axis::Focus]->speed = lens.speed_steps_per_s;
  capabilities.axes[Axis::Focus]->settle = Duration(std::llround(lens.settle_ms * 1e6));
  // As a data sheet would tell. An encoder sits behind it.
  const bool open_loop = lens.feedback != drivers::Feedback::Encoder;
  capabilities.axes[Axis::Focus]->backlash = open_loop ? lens.backlash_steps : 0.0;
  if (lens.max_f_number > lens.min_f_number) {
    capabilities.axes[Axis::Iris] = AxisOver(lens, NativeUnit::Steps, 0.0, lens.iris_steps - 1.0, 1.0);
    capabilities.axes[Axis::Iris]->backlash = open_loop ? lens.iris_backlash_steps : 0.0;
  }
  if (lens.zooms()) {
    const double span = lens.max_focal_length_mm - lens.min_focal_length_mm;
    capabilities.axes[Axis::Zoom] =
        AxisOver(lens, NativeUnit::Millimetres, lens.min_focal_length_mm, lens.max_focal_length_mm, span / kZoomPlaces);
  }
  if (!lens.filter_focus_um.empty()) {
    capabilities.axes[Axis::Filter] =
        AxisOver(lens, NativeUnit::Position, 1.0, static_cast<double>(lens.filter_focus_um.size()), 1.0);
    capabilities.axes[Axis::Filter]->can_stop = false;  // a wheel goes to its place
  }
  return capabilities;
}

Mechanics::Mechanics(std::shared_ptr<const Scene> scene, const Clock& clock, double focus_start)
    : scene_(std::move(scene)),
      clock_(clock),
      epoch_(clock.Now()),
      capabilities_(CapabilitiesOf(scene_->lens)),
      focus_off_m_(FocusOffOf(*scene_)),
      faults_(scene_->faults) {
  const LensSettings& lens = scene_->lens;
  motors_[Axis::Focus].emplace(FocusMotor(lens), focus_start);
  if (capabilities_.axes[Axis::Iris]) {
    motors_[Axis::Iris].emplace(IrisMotor(lens), IrisPlace(lens, lens.initial_f_number));
  }
  if (capabilities_.axes[Axis::Zoom]) {
    motors_[Axis::Zoom].emplace(SweepMotor(lens.min_focal_length_mm, lens.max_focal_length_mm, kZoomSweep_s),
                                lens.min_focal_length_mm);
  }
  if (const auto places = static_cast<double>(lens.filter_focus_um.size()); places > 0.0) {
    motors_[Axis::Filter].emplace(SweepMotor(1.0, places, kFilter_s * (places - 1.0)), 1.0);
  }
}

double Mechanics::Grid(Axis axis) const {
  return capabilities_.axes[axis]->resolution;
}

void Mechanics::MoveTo(Axis axis, double target) {
  const std::lock_guard lock(mutex_);
  const Duration now = Advance();
  const drivers::AxisCapabilities& can = *capabilities_.axes[axis];
  const double low = can.minimum.value;
  const double place = low + std::round((target - low) / can.resolution) * can.resolution;
  const double goal = std::clamp(place, can.lowest_count().value, can.highest_count().value);
  told_[axis] = goal;
  // With an encoder the loop is closed on the mechanism, whatever the motor's count.
  const bool closed = can.feedback == drivers::Feedback::Encoder;
  const double behind = closed ? motors_[axis]->CountAt(now) - motors_[axis]->RestPlaceAt(now) : 0.0;
  motors_[axis]->MoveTo(now, goal + behind);
}

void Mechanics::Home(Axis axis) {
  const std::lock_guard lock(mutex_);
  const Duration now = Advance();
  told_[axis].reset();
  motors_[axis]->Home(now);
}

void Mechanics::Halt(Axis axis) {
  const std::lock_guard lock(mutex_);
  const Duration now = Advance();
  told_[axis].reset();
  motors_[axis]->Halt(now, Grid(axis));
}

double Mechanics::PositionAt(Axis axis, Duration at) const {
  const Motor& motor = *motors_[axis];
  switch (capabilities_.axes[axis]->feedback) {
    case drivers::Feedback::Encoder:
      return std::round(motor.PlaceAt(at) / Grid(axis)) * Grid(axis);
    case drivers::Feedback::Counts:
      return motor.CountAt(at);
    default:
      return told_[axis].value_or(motor.CountAt(at));
  }
}

drivers::LensState Mechanics::Report(const drivers::PerAxis<std::optional<Duration>>& frozen) {
  const std::lock_guard lock(mutex_);
  const Duration now = Advance();
  drivers::LensState state;
  state.sampled_at = InstantOf(now);
  if (scene_->lens.thermometer) {
    const auto wrong = faults_.ActiveAt(FaultKind::WrongTemperature, now);
    state.temperature = Celsius{TemperatureAt(now) + (wrong ? wrong->by_c : 0.0)};
  }
  for (const Axis axis : drivers::kAxes) {
    if (!motors_[axis]) continue;
    const Motor& motor = *motors_[axis];
    const Duration at = frozen[axis].value_or(now);
    drivers::AxisState& report = state.axes[axis].emplace();
    report.position = Native{PositionAt(axis, at)};
    report.moving = capabilities_.axes[axis]->feedback != drivers::Feedback::None && motor.MovingAt(at);
    report.homed = motor.HomedAt(at) || !capabilities_.axes[axis]->can_home;
    if (motor.ComplainsAt(at)) report.fault = "stalled";
  }
  return state;
}

TrueState Mechanics::StateAt(Duration at) {
  const std::lock_guard lock(mutex_);
  Advance();
  return StateOf(at);
}

Duration Mechanics::Earliest() {
  const std::lock_guard lock(mutex_);
  Duration earliest{};
  for (const Axis axis : drivers::kAxes) {
    if (motors_[axis]) earliest = std::max(earliest, motors_[axis]->earliest());
  }
  return earliest;
}

std::optional<Fault> Mechanics::FaultAt(FaultKind kind, Duration at, std::optional<Axis> axis) {
  const std::lock_guard lock(mutex_);
  return faults_.ActiveAt(kind, at, axis);
}

bool Mechanics::Disconnected() {
  const std::lock_guard lock(mutex_);
  return faults_.DisconnectedAt(Now());
}

void Mechanics::Inject(Fault fault) {
  const std::lock_guard lock(mutex_);
  // Up to the next microsecond: what has happened by now is not to be overtaken by a rounding.
  const auto next = std::chrono::duration_cast<std::chrono::microseconds>(Advance()).count() + 1;
  fault.at_ms = 1e-3 * static_cast<double>(next);
  faults_.Add(fault);
}

Duration Mechanics::Advance() {
  const Duration now = Now();
  while (const auto event = faults_.TakeDue(now)) Happen(*event);
  return now;
}

void Mechanics::Happen(const FaultLine::Event& event) {
  if (event.fault.kind == FaultKind::Disconnect) return LosePower(event.at);
  auto& motor = motors_[event.fault.axis];
  if (!motor) return;
  switch (event.fault.kind) {
    case FaultKind::Stall:
      return motor->SetStalled(event.at, event.begins);
    case FaultKind::MissedSteps:
      return motor->SetLoss(event.at, event.begins ? event.fault.factor : 0.0);
    default:
      return motor->Knock(event.at, event.fault.steps);
  }
}

void Mechanics::LosePower(Duration at) {
  told_ = {};
  for (const Axis axis : drivers::kAxes) {
    if (motors_[axis]) motors_[axis]->LosePower(at);
  }
}

double Mechanics::TemperatureAt(Duration at) const {
  const auto warmth = faults_.ActiveAt(FaultKind::Warmth, at);
  return scene_->lens.temperature_c + (warmth ? warmth->by_c : 0.0);
}

TrueState Mechanics::StateOf(Duration at) const {
  const LensSettings& lens = scene_->lens;
  TrueState state;
  state.focus_steps = motors_[Axis::Focus]->PlaceAt(at);
  const double along = state.focus_steps / (lens.steps - 1.0);
  state.extension_m = ExtensionAlong(lens, along) + 1e-6 * lens.drift_um_per_c * (TemperatureAt(at) - kCalibration_c);
  if (motors_[Axis::Filter]) {
    state.filter = motors_[Axis::Filter]->PlaceAt(at);
    const double place = std::clamp(std::round(*state.filter), 1.0, static_cast<double>(lens.filter_focus_um.size()));
    state.extension_m -= 1e-6 * lens.filter_focus_um[static_cast<std::size_t>(place) - 1];
  }
  state.f_number = lens.min_f_number;
  if (motors_[Axis::Iris]) {
    state.iris_steps = motors_[Axis::Iris]->PlaceAt(at);
    const double open = *state.iris_steps / (lens.iris_steps - 1.0);
    state.f_number = lens.min_f_number * std::pow(lens.max_f_number / lens.min_f_number, open);
  }
  // Where spherical aberration leaves the spot's mean square smallest goes with the square of the opening.
  state.extension_m -= 1e-6 * lens.focus_shift_um * std::pow(lens.min_f_number / state.f_number, 2);
  if (motors_[Axis::Zoom]) state.zoom_mm = motors_[Axis::Zoom]->PlaceAt(at);
  const double nominal_m = 1e-3 * state.zoom_mm.value_or(lens.min_focal_length_mm);
  if (lens.zooms()) {
    const double zoomed =
        (1e3 * nominal_m - lens.min_focal_length_mm) / (lens.max_focal_length_mm - lens.min_focal_length_mm);
    state.optics.centre_shift_m = 1e-3 * lens.centre_shift_mm * zoomed;
  }
  state.optics.model = lens.model;
  // The focal length a scene states, and the opening with it, is that at extension 0.
  const double at_infinity = -lens.min_extension_mm / (lens.max_extension_mm - lens.min_extension_mm);
  state.optics.focal_length_m = nominal_m * (1.0 + lens.breathing * (along - at_infinity));
  state.optics.aperture_diameter_m = nominal_m / state.f_number;
  state.optics.sensor_distance_m = state.optics.focal_length_m + state.extension_m;
  state.optics.magnification = state.optics.focal_length_m / (1e-3 * lens.min_focal_length_mm);
  if (!lens.telecentric) state.optics.magnification *= state.optics.sensor_distance_m / state.optics.focal_length_m;
  if (lens.liquid) {
    state.optics.magnification = 1.0;
    state.optics.focal_length_m = nominal_m - state.extension_m;
    state.optics.sensor_distance_m = nominal_m;
  }
  state.sway_d = SwayD(*scene_, std::chrono::duration<double>(at).count());
  state.focal_plane_d = 1.0 / state.optics.focal_length_m - 1.0 / (state.optics.sensor_distance_m - focus_off_m_);
  return state;
}

}  // namespace lensd::sim
