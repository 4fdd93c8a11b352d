// Input shaping: a step divided into smaller ones, timed so that the ringings they set off cancel each other.
//
// A lightly damped actuator (a voice coil) answers a step with A e^(-zwt) sin(wd t). Two steps half a damped period
// apart ring in opposite phase; with amplitudes 1 : K, K = e^(-z pi/sqrt(1 - z^2)), what is left of the first by then
// is cancelled by the second (zero vibration, ZV). Convolving ZV with itself (ZVD) also zeroes the derivative of the
// residual with respect to the frequency: three steps over one period, for an actuator that is only roughly known. A
// split step is ZV for an undamped actuator; a ramp spreads the step evenly over one period. Source: Singer and
// Seering, "Preshaping command inputs to reduce system vibration", 1990.
#pragma once

#include <vector>

#include "base/clock.h"
#include "rig/config.h"

namespace lensd::rig {

/// A part of a step. The parts of one shaper come in order of time from 0 and sum to 1.
struct Impulse {
  Duration at{};
  double part = 1.0;
};

/// Empty for Shaper::None. `ring_hz` > 0 is the frequency at which the actuator is seen to ring (damping included),
/// `damping` in [0, 1) is of critical.
std::vector<Impulse> ImpulsesOf(Shaper shaper, double ring_hz, double damping);

/// Even parts over `whole`, at most `each` apart: a step that goes on as slowly as that. Empty where it is over sooner.
std::vector<Impulse> PacedParts(Duration whole, Duration each);

}  // namespace lensd::rig
