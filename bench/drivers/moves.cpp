// Motions go between random places that are the same every time. The mechanism is looked at after every step of the
// rig, at least every millisecond.
#include "bench/drivers/moves.h"

#include <cmath>
#include <optional>
#include <random>

#include "rig/rig.h"

namespace lensd::bench {
namespace {

using drivers::Axis;
using drivers::Lens;

/// Cameras by UVC are sent two values at least 50 ms apart: a pause that the command before has caused is none of the
/// command that is timed.
constexpr Duration kBetweenCommands = std::chrono::milliseconds(60);
constexpr double kThere = 1.0;  // native steps: the rig's own tolerance
constexpr auto kLook = std::chrono::milliseconds(1);
constexpr auto kNeverLonger = std::chrono::seconds(60);

double MillisecondsOf(Duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

/// How long a call took on the stand's own clock.
template <class Call>
double Timed(const Clock& clock, Call&& call) {
  const Instant began = clock.Now();
  call();
  return MillisecondsOf(clock.Now() - began);
}

/// Reads until the axis rests (and is homed, where that is asked). Timeout: it never does.
Result<void> AwaitRest(DriverStand& stand, Lens& lens) {
  const Instant end = stand.clock().Now() + kNeverLonger;
  while (stand.clock().Now() < end) {
    const auto state = lens.Read();
    if (state && !state->axes[Axis::Focus]->moving) return {};
    stand.WaitUntil(stand.clock().Now() + kLook);
  }
  return Fail(Code::Timeout, lens.capabilities().driver + ": the focus motor does not come to rest");
}

Result<drivers::Device> OpenHomedAtOnce(DriverStand& stand) {
  auto device = stand.Open();
  if (!device) return device;
  Lens& lens = *device->lens;
  const auto& focus = *lens.capabilities().axes[Axis::Focus];
  if (!focus.needs_home && !focus.can_home) return device;
  if (auto started = lens.StartHome(Axis::Focus); !started) return PassOn(started);
  if (auto rests = AwaitRest(stand, lens); !rests) return PassOn(rests);
  return device;
}

/// The device's lens, homed where it has to be. On a busy machine an answer within a device's deadline may fail to
/// come: that says nothing of drivers.
Result<drivers::Device> OpenHomed(DriverStand& stand) {
  constexpr int kAttempts = 10;
  auto device = OpenHomedAtOnce(stand);
  for (int i = 1; !device && device.error().code == Code::Timeout && i < kAttempts; ++i)
    device = OpenHomedAtOnce(stand);
  return device;
}

/// Where motions go: anywhere between the ends.
class Places {
 public:
  explicit Places(const drivers::AxisCapabilities& axis) : low_(axis.minimum.value), high_(axis.maximum.value) {}
  double Next() { return std::round(std::uniform_real_distribution<double>(low_, high_)(random_)); }
  double low() const { return low_; }
  double high() const { return high_; }

 private:
  double low_, high_;
  std::mt19937 random_{20};
};

Result<void> TimeCalls(DriverStand& stand, Lens& lens, int count, DriverTimes& times) {
  const Clock& clock = stand.clock();
  const auto& axis = *lens.capabilities().axes[Axis::Focus];
  for (int i = 0; i < count; ++i) {
    Result<drivers::LensState> state;
    times.reading.push_back(Timed(clock, [&] { state = lens.Read(); }));
    if (!state) return PassOn(state);
  }
  for (int i = 0; i < count; ++i) {
    // To the far end, and a stop a third of the way there.
    const double from = stand.TrueFocus();
    const double to = from > 0.5 * (axis.minimum.value + axis.maximum.value) ? axis.minimum.value : axis.maximum.value;
    Result<void> done;
    stand.WaitUntil(clock.Now() + kBetweenCommands);
    times.command.push_back(Timed(clock, [&] { done = lens.StartMove(Axis::Focus, Native{to}); }));
    if (!done) return done;
    const Instant patience = clock.Now() + kNeverLonger;
    while (std::abs(stand.TrueFocus() - from) < std::abs(to - from) / 3 && clock.Now() < patience) {
      stand.WaitUntil(clock.Now() + kLook);
      if (const auto state = lens.Read(); !state) return PassOn(state);
    }
    const double then = stand.TrueFocus();
    times.stop.push_back(Timed(clock, [&] { done = lens.Stop(Axis::Focus); }));
    if (!done) return done;
    if (auto rests = AwaitRest(stand, lens); !rests) return rests;
    times.stop_travel.push_back(std::abs(stand.TrueFocus() - then));
  }
  return {};
}

void StepOnce(DriverStand& stand, rig::Rig& rig) {
  const Instant now = stand.clock().Now(), next = rig.Step(now);
  // On a stepped clock the rig may ask for this very instant.
  stand.WaitUntil(
      std::max(std::min(next, stand.clock().Now() + kLook), stand.clock().Now() + std::chrono::microseconds(50)));
}

/// Good weather until the lens is there and its motor stands: every move begins alike.
void ClearUp(DriverStand& stand, rig::Rig& rig) {
  stand.SetWeather({});
  const Instant patience = stand.clock().Now() + std::chrono::seconds(5);
  for (int standing = 0; standing < 5 && stand.clock().Now() < patience;) {
    const double before = stand.TrueFocus();
    StepOnce(stand, rig);
    standing = rig.GetStatus().connected && stand.TrueFocus() == before ? standing + 1 : 0;
  }
}

/// One motion by the rig.
struct Moved {
  Result<rig::MoveOutcome> outcome = Fail(Code::Timeout, "never ended");
  double took = 0.0, travel = 0.0;  ///< ms
  double truth = 0.0;               ///< when it ended
};

Result<Moved> MoveOnce(DriverStand& stand, rig::Rig& rig, double target) {
  const Clock& clock = stand.clock();
  const Instant began = clock.Now();
  Moved moved;
  bool ended = false;
  std::optional<Instant> there;
  rig.Move(Axis::Focus, {.kind = rig::Target::Kind::Native, .value = target, .from = {}},
           [&](Result<rig::MoveOutcome> outcome) {
             moved.truth = stand.TrueFocus();
             moved.outcome = std::move(outcome);
             ended = true;
           });
  while (!ended) {
    if (clock.Now() - began > kNeverLonger) return Fail(Code::Timeout, "a move never ended");
    StepOnce(stand, rig);
    if (std::abs(stand.TrueFocus() - target) > kThere) {
      there.reset();
    } else if (!there) {
      there = clock.Now();
    }
  }
  moved.took = MillisecondsOf(clock.Now() - began);
  moved.travel = MillisecondsOf(there.value_or(clock.Now()) - began);
  return moved;
}

}  // namespace

Result<DriverTimes> TimeDriver(DriverStand& stand, int count) {
  DriverTimes times;
  for (int i = 0; i < count; ++i) {
    Result<void> done;
    times.bare_exchange.push_back(Timed(stand.clock(), [&] { done = stand.BareExchange(); }));
    if (!done) return PassOn(done);
  }
  auto device = OpenHomed(stand);
  if (!device) return PassOn(device);
  if (auto timed = TimeCalls(stand, *device->lens, count, times); !timed) return PassOn(timed);
  Places places(*device->lens->capabilities().axes[Axis::Focus]);
  auto rig = rig::Rig::Create(stand.Config(), *std::move(device), stand.clock());
  if (!rig) return PassOn(rig);
  for (int i = 0; i < count; ++i) {
    auto moved = MoveOnce(stand, **rig, places.Next());
    if (!moved) return PassOn(moved);
    if (!moved->outcome) return PassOn(moved->outcome);
    times.move.push_back(moved->took);
    times.travel.push_back(moved->travel);
    times.beyond.push_back(moved->took - moved->travel);
    times.error.push_back(std::abs(moved->outcome->position.value - moved->truth));
  }
  return times;
}

Result<DriverOutcomes> MoveInWeather(DriverStand& stand, const Weather& weather, int moves) {
  auto device = OpenHomed(stand);
  if (!device) return PassOn(device);
  Places places(*device->lens->capabilities().axes[Axis::Focus]);
  auto rig = rig::Rig::Create(stand.Config(), *std::move(device), stand.clock());
  if (!rig) return PassOn(rig);
  DriverOutcomes outcomes;
  for (int i = 0; i < moves; ++i) {
    stand.SetWeather(weather);
    const double target = places.Next();
    auto moved = MoveOnce(stand, **rig, target);
    if (!moved) return PassOn(moved);
    ++outcomes.moves;
    outcomes.took.push_back(moved->took);
    if (!moved->outcome || !moved->outcome->reached) {
      ++outcomes.refused;
    } else if (std::abs(moved->truth - target) > kThere) {
      ++outcomes.false_reached;
    } else {
      ++outcomes.within;
      outcomes.verified += moved->outcome->verified ? 1 : 0;
    }
    ClearUp(stand, **rig);
  }
  return outcomes;
}

}  // namespace lensd::bench
