// What the configuration leaves open is taken from the driver; what neither says is assumed, on the safe side.
#include "rig/motion/axis_setup.h"

#include <algorithm>
#include <utility>

namespace lensd::rig {
namespace {

/// Of all travel: what a stepping motor may lose in ordinary use. Knocks are another matter.
constexpr double kLostByStepping = 1e-4;

double LostTravel(const drivers::AxisCapabilities& can, const AxisConfig& config) {
  if (config.lost_travel) return *config.lost_travel;
  if (can.lost_travel >= 0.0) return can.lost_travel;
  return can.feedback == drivers::Feedback::Counts ? kLostByStepping : 0.0;
}

}  // namespace

void SetLimits(AxisSetup& setup, Native offset) {
  ++setup.limits_set;
  setup.minimum = std::max(setup.can.minimum, setup.can.lowest_count() + offset);
  setup.maximum = std::min(setup.can.maximum, setup.can.highest_count() + offset);
  if (setup.config.limits) {
    setup.minimum = std::max(setup.minimum, setup.config.limits->first);
    setup.maximum = std::min(setup.maximum, setup.config.limits->second);
  }
  // A count that is off by more than the travel leaves nothing of it.
  setup.maximum = std::max(setup.minimum, setup.maximum);
}

void SetLimitsAround(AxisSetup& setup, Native here) {
  ++setup.limits_set;
  const Native travel = setup.can.maximum - setup.can.minimum;
  setup.minimum = std::max(here - travel, setup.can.lowest_count());
  setup.maximum = std::min(here + travel, setup.can.highest_count());
  setup.maximum = std::max(setup.minimum, setup.maximum);
}

void SetBacklash(AxisSetup& setup, std::optional<double> backlash) {
  setup.config.backlash = backlash;
  if (!backlash && setup.can.backlash >= 0.0) backlash = setup.can.backlash;
  // A lens that counts in optical units or in places closes the loop behind its own gears.
  setup.backlash_known = backlash || setup.can.unit != drivers::NativeUnit::Steps;
  const double assumed = setup.backlash_known ? 0.0 : kAssumedBacklash * (setup.maximum - setup.minimum).value;
  setup.backlash = backlash.value_or(assumed);
}

void SetDirection(AxisSetup& setup, FocusDirection direction) {
  setup.approach_up = direction.approach_up;
  setup.direction = std::move(direction);
}

AxisSetup MakeSetup(drivers::Axis axis, const drivers::AxisCapabilities& can, const AxisConfig& config) {
  AxisSetup setup;
  setup.axis = axis;
  setup.can = can;
  setup.config = config;
  SetLimits(setup, {});
  setup.settle = config.settle.value_or(can.settle);
  setup.speed = config.speed;
  if (!setup.speed && can.speed > 0) setup.speed = can.speed;
  // A neighbouring filter is another filter.
  setup.tolerance = config.tolerance.value_or(axis == drivers::Axis::Filter ? 0.5 * can.resolution : can.resolution);
  if (axis == drivers::Axis::Focus) SetDirection(setup, DirectionOf(config, can, nullptr));
  SetBacklash(setup, config.backlash);
  setup.lost_travel = LostTravel(can, config);
  setup.impulses = ImpulsesOf(config.shaper, config.ring_hz, config.ring_damping);
  return setup;
}

}  // namespace lensd::rig
