// Focus, iris and zoom of a camera terminal. Controls are set and read back; what changes between readings counts as
// motion.
#include "uvc_lens.h"

#include <array>
#include <utility>

#include "drivers/api/thread_barrier.h"

namespace lensd::drivers::uvc {
namespace {

/// A motor that has not begun within this time of a command, or shows no change for as long, stands still.
constexpr Duration kStill = std::chrono::milliseconds(300);
/// Of all travel: a motor with gears runs for a time, which is less exact than steps.
constexpr double kLostByGears = 1e-3;
constexpr std::array<Axis, 3> kAbsoluteAxes = {Axis::Focus, Axis::Iris, Axis::Zoom};

const UnitControl& ControlOf(Axis axis) {
  if (axis == Axis::Iris) return kIrisAbsolute;
  return axis == Axis::Zoom ? kZoomAbsolute : kFocusAbsolute;
}

std::string NameOf(Axis axis) {
  return std::string(AxisName(axis));
}

double Milliseconds(Duration duration) {
  return static_cast<double>(duration.count()) * 1e-6;
}

/// A run cannot be ended before the next setting is allowed.
double ResolutionMs(const ControlOptions& options) {
  return std::max(10.0, Milliseconds(options.interval));
}

/// USB video class, CT_FOCUS_RELATIVE_CONTROL: 1 is toward near, 0xFF toward infinity; travel is counted from the far
/// end. Of CT_FOCUS_ABSOLUTE_CONTROL nothing can be vouched for: by the class it is the distance in millimetres, larger
/// being farther, and most cameras count something of their own.
constexpr KnownDirection kByTheClass{Direction::NearPositive, "the USB video class (relative focus)"};

AxisCapabilities RelativeCapabilities(const LensConfig& config, double resolution_ms) {
  AxisCapabilities can;
  can.unit = NativeUnit::Position;
  can.maximum = Native{Milliseconds(*config.focus_travel)};
  can.resolution = resolution_ms;
  can.feedback = Feedback::None;
  can.lost_travel = kLostByGears;
  can.can_home = can.needs_home = true;
  can.speed = 1000.0;
  can.direction = kByTheClass;
  return can;
}

/// Automatics that cannot be switched off cost no axis: they may set back what is set by hand, or do not exist.
Result<void> TakeFromAutomatics(Session& session, Findings& findings) {
  const auto doubt = [&](const Result<void>& taken, const char* what) -> Result<void> {
    if (taken || ConcernsAll(taken.error())) return taken;
    findings.Doubt(std::string(what) + " could not be switched off and may move it: " + taken.error().message);
    return {};
  };
  const CameraTerminal& terminal = session.terminal;
  Result<void> done;
  if (terminal.Has(kFocusAbsolute.bit) || terminal.Has(kFocusRelative.bit)) {
    done = doubt(session.automatics.TakeFocus(), "focus: the camera's own autofocus");
  }
  if (done && terminal.Has(kIrisAbsolute.bit)) {
    done = doubt(session.automatics.TakeIris(), "iris: the camera's automatic exposure");
  }
  return done;
}

}  // namespace

Result<UvcLens::AbsoluteAxis> UvcLens::AskAxis(Session& session, Axis axis, const LensConfig& config) {
  const UnitControl& control = ControlOf(axis);
  auto range = ReadRange(session.controls, session.At(control), control, NameOf(axis));
  if (!range) return PassOn(range);
  AbsoluteAxis absolute;
  absolute.control = control;
  absolute.range = *range;
  absolute.current = range->current;
  if (axis == Axis::Iris && config.iris_is_f_number) absolute.unit = 0.01;
  return absolute;
}

Result<UvcLens::Axes> UvcLens::FindAxes(Session& session, const LensConfig& config, Findings& findings) {
  Axes axes;
  for (const Axis axis : kAbsoluteAxes) {
    if (!session.terminal.Has(ControlOf(axis).bit)) continue;
    auto asked = AskAxis(session, axis, config);
    if (!asked && ConcernsAll(asked.error())) return PassOn(asked);
    if (!asked) findings.LeaveOut(AxisName(axis), asked.error());
    if (asked) axes[axis] = *asked;
  }
  return axes;
}

Result<std::unique_ptr<Lens>> UvcLens::Open(std::shared_ptr<Session> session, const LensConfig& config,
                                            Findings& findings) {
  session->transport().BeginCall();
  if (session->terminal.id == 0) return std::unique_ptr<Lens>();
  if (auto taken = TakeFromAutomatics(*session, findings); !taken) return PassOn(taken);
  auto axes = FindAxes(*session, config, findings);
  if (!axes) return PassOn(axes);
  Capabilities can;
  can.driver = "uvc";
  can.model = session->identity.model;
  can.serial = session->identity.serial;
  bool any = false;
  for (const Axis axis : kAbsoluteAxes) {
    if (!(*axes)[axis]) continue;
    any = true;
    const AbsoluteAxis& absolute = *(*axes)[axis];
    AxisCapabilities of;
    if (absolute.unit != 1.0) of.unit = NativeUnit::FNumber;
    of.minimum = Native{static_cast<double>(absolute.range.minimum) * absolute.unit};
    of.maximum = Native{static_cast<double>(absolute.range.maximum) * absolute.unit};
    of.resolution = static_cast<double>(absolute.range.resolution) * absolute.unit;
    of.feedback = config.feedback;
    of.can_stop = Follows(config.feedback);
    can.axes[axis] = of;
  }
  if (!(*axes)[Axis::Focus] && session->terminal.Has(kFocusRelative.bit)) {
    if (config.focus_travel) {
      any = true;
      findings.TakeBack(AxisName(Axis::Focus));
      can.axes[Axis::Focus] = RelativeCapabilities(config, ResolutionMs(session->controls.options()));
    } else {
      findings.LeaveOut(AxisName(Axis::Focus),
                        {Code::Unsupported,
                         "this camera's focus knows only nearer and farther: set focus_travel_ms, "
                         "the time from end to end"});
    }
  }
  if (!any) return std::unique_ptr<Lens>();
  return std::unique_ptr<Lens>(new UvcLens(std::move(can), std::move(session), config, *axes));
}

UvcLens::UvcLens(Capabilities capabilities, std::shared_ptr<Session> session, const LensConfig& config,
                 const Axes& axes)
    : Lens(std::move(capabilities)), session_(std::move(session)), config_(config), axes_(axes) {
  if (axes_[Axis::Focus] || !this->capabilities().axes[Axis::Focus]) return;
  relative_.emplace(
      session_->clock, *config_.focus_travel, ResolutionMs(session_->controls.options()), [this](int direction) {
        const auto byte = static_cast<std::uint8_t>(direction);
        const std::array<std::uint8_t, 2> bytes = {byte, direction == 0 ? std::uint8_t{0} : config_.focus_speed};
        auto set = session_->controls.Set(session_->At(kFocusRelative), bytes, "focus");
        return RelativeFocus::Sent{std::move(set), session_->controls.set_without_effect()};
      });
}

UvcLens::~UvcLens() {
  Contain([this] { Halt(); });
}

/// Nothing goes on moving unwatched.
void UvcLens::Halt() {
  session_->transport().BeginCall();
  if (session_->transport().Gone()) return;
  if (relative_ && relative_->running()) (void)relative_->Stop();
  for (const Axis axis : kAbsoluteAxes) {
    auto& absolute = axes_[axis];
    if (absolute && Follows(config_.feedback) && absolute->target && absolute->current != *absolute->target) {
      if (const auto here = ReadCurrent(axis, *absolute)) (void)SetTo(axis, *here);
    }
  }
}

Result<void> UvcLens::DoStartHome(Axis) {
  session_->transport().BeginCall();
  return relative_->StartHome();
}

Result<void> UvcLens::DoStartMove(Axis axis, Native target) {
  session_->transport().BeginCall();
  if (session_->transport().Gone()) return Fail(Code::Disconnected, "the camera is unplugged");
  if (axis == Axis::Focus && relative_) return relative_->StartMove(target.value);
  const AbsoluteAxis& absolute = *axes_[axis];
  return SetTo(axis, absolute.range.Nearest(target.value / absolute.unit));
}

Result<void> UvcLens::SetTo(Axis axis, std::int64_t value) {
  AbsoluteAxis& absolute = *axes_[axis];
  TakeEvents();
  // Whatever becomes of the answer, from now on nothing but the new target counts as arrived.
  absolute.target = value;
  absolute.changed_at = session_->clock.Now();
  absolute.failed = false;
  absolute.awaiting =
      absolute.range.asynchronous && config_.completion_events && session_->function.status_endpoint != 0;
  auto set = SetOnce(axis, absolute, value);
  if (set || session_->controls.last_refusal() != Refusal::WrongState || set.error().code != Code::Busy) return set;
  // Another program, or the camera itself, has switched the automatics on again.
  auto taken = axis == Axis::Iris ? session_->automatics.TakeIris() : session_->automatics.TakeFocus();
  return taken ? SetOnce(axis, absolute, value) : taken;
}

Result<void> UvcLens::SetOnce(Axis axis, const AbsoluteAxis& absolute, std::int64_t value) {
  const auto bytes = ToLittle(static_cast<std::uint32_t>(value), absolute.control.length);
  return session_->controls.Set(session_->At(absolute.control), bytes, NameOf(axis));
}

Result<std::int64_t> UvcLens::ReadCurrent(Axis axis, const AbsoluteAxis& absolute) {
  auto bytes = session_->controls.Get(kGetCur, session_->At(absolute.control), absolute.control.length, NameOf(axis));
  if (!bytes) return PassOn(bytes);
  return FromLittle(*bytes);
}

Result<AxisState> UvcLens::ReadAxis(Axis axis, AbsoluteAxis& absolute) {
  const std::int64_t before = absolute.current;
  auto read = ReadCurrent(axis, absolute);
  if (!read) return PassOn(read);
  const std::int64_t now = *read;
  absolute.current = now;
  if (now != before) absolute.changed_at = session_->clock.Now();
  AxisState state;
  state.position = Native{static_cast<double>(now) * absolute.unit};
  if (absolute.failed) state.fault = "the camera reports that the last move failed";
  if (!absolute.target) return state;
  const bool there = now == *absolute.target;
  if (Follows(config_.feedback)) {
    // Once there and once more there: what passes through has not arrived.
    const bool arrived = there && before == now;
    state.moving = !arrived && session_->clock.Now() - absolute.changed_at < kStill;
  } else {
    // What reads back is what was set, or it was not taken; a failed move never counts as arrived.
    state.moving = !there || absolute.awaiting || absolute.failed;
  }
  return state;
}

Result<LensState> UvcLens::DoRead() {
  session_->transport().BeginCall();
  session_->transport().CheckThread();
  if (session_->transport().Gone()) return Fail(Code::Disconnected, "the camera is unplugged");
  TakeEvents();
  LensState state;
  // Stamped before asking: a reading is never older than it says.
  state.sampled_at = session_->clock.Now();
  for (const Axis axis : kAbsoluteAxes) {
    if (!axes_[axis]) continue;
    auto one = ReadAxis(axis, *axes_[axis]);
    if (!one) return PassOn(one);
    state.axes[axis] = *std::move(one);
  }
  if (relative_) {
    auto one = relative_->Read();
    if (!one) return PassOn(one);
    state.axes[Axis::Focus] = *std::move(one);
  }
  return state;
}

Result<void> UvcLens::DoStop(Axis axis) {
  session_->transport().BeginCall();
  if (axis == Axis::Focus && relative_) return relative_->Stop();
  auto here = ReadCurrent(axis, *axes_[axis]);
  if (!here) return PassOn(here);
  return SetTo(axis, *here);
}

void UvcLens::TakeEvents() {
  for (const auto& packet : session_->transport().TakeStatus()) {
    const auto event = ParseStatus(packet);
    if (!event || event->entity != session_->terminal.id) continue;
    for (const Axis axis : kAbsoluteAxes) {
      auto& absolute = axes_[axis];
      if (!absolute || absolute->control.selector != event->selector) continue;
      if (event->attribute == StatusEvent::Attribute::Failure) {
        absolute->failed = absolute->awaiting;
        absolute->awaiting = false;
      } else if (event->attribute == StatusEvent::Attribute::Value) {
        // The end of an earlier move carries another value; without one it proves nothing.
        const std::size_t length = absolute->control.length;
        if (event->value.size() < length) continue;
        if (FromLittle(std::span(event->value).first(length)) == absolute->target) absolute->awaiting = false;
      }
    }
  }
}

}  // namespace lensd::drivers::uvc
