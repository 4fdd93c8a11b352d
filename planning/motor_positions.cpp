// A motion ends within a bound of its target that depends on where it starts from and on what the mechanism may have
// lost. It widens each position by what lies between it and the places around it.
#include "planning/motor_positions.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "optics/conjugates.h"
#include "planning/planning.h"

namespace lensd::daemon {
namespace {

using drivers::Axis;
using optics::FocusPosition;

/// Relative: how far the focal length may be off with the zoom within `bound` of a place.
double ZoomError(const rig::OpticsTable& optics, Native native, Native bound) {
  const double middle = optics.FocalLengthFromNative(native).value;
  const double low = optics.FocalLengthFromNative(native - bound).value;
  const double high = optics.FocalLengthFromNative(native + bound).value;
  return std::max(std::abs(low - middle), std::abs(high - middle)) / middle;
}

/// Where the planes of a rising or falling list lie between its entries, and beyond its ends.
double PlaneAt(const std::vector<FocusPosition>& focus, double index) {
  const double last = static_cast<double>(focus.size()) - 1.0;
  if (last == 0.0) return focus.front().focal_plane.value;
  const auto below = static_cast<std::size_t>(std::clamp(std::floor(index), 0.0, last - 1.0));
  return std::lerp(focus[below].focal_plane.value, focus[below + 1].focal_plane.value,
                   index - static_cast<double>(below));
}

/// Of the focal length, once a motion from `now` has ended.
double ZoomErrorThen(const Planning& planning, const rig::Status& now) {
  const rig::OpticsTable& optics = *planning.lens.optics;
  const auto& zoom = now.axes[Axis::Zoom];
  if (zoom && planning.zoom) return ZoomError(optics, *planning.zoom, zoom->arrival.BoundAt(*planning.zoom));
  return ZoomErrorNow(optics, now);
}

/// What BoundAt() depends on: without backlash and lost travel every target is within the same of it.
rig::Arrival Deciding(const rig::Arrival& arrival) {
  if (arrival.backlash == 0.0 && arrival.not_taken_up == 0.0 && arrival.lost_travel == 0.0) {
    rig::Arrival anywhere;
    anywhere.rest = arrival.rest;
    return anywhere;
  }
  return arrival;
}

MotorsNow MotorsOf(const Planning& planning, const rig::Status& now) {
  MotorsNow motors{.zoom_error = ZoomErrorThen(planning, now), .focus = std::nullopt, .iris = std::nullopt};
  if (const auto& focus = now.axes[Axis::Focus]) motors.focus = Deciding(focus->arrival);
  if (const auto& iris = now.axes[Axis::Iris]) motors.iris = Deciding(iris->arrival);
  return motors;
}

optics::LensPositions WithMotors(const Planning& planning, const MotorsNow& motors) {
  optics::LensPositions positions = planning.positions;
  const rig::OpticsTable& optics = *planning.lens.optics;
  positions.focal_length_error += motors.zoom_error;
  for (std::size_t i = 0; i < positions.focus.size(); ++i) {
    FocusPosition& position = positions.focus[i];
    position.bound = position.bound + ZoomShift(position, motors.zoom_error);
    if (planning.focus.size() < 2 || !motors.focus) continue;
    const double step = std::abs((planning.focus.back() - planning.focus.front()).value) /
                        static_cast<double>(planning.focus.size() - 1);
    const double off = motors.focus->BoundAt(planning.focus[i]).value / step;
    const double here = static_cast<double>(i), plane = position.focal_plane.value;
    const double reach = std::max(std::abs(PlaneAt(planning.positions.focus, here + off) - plane),
                                  std::abs(PlaneAt(planning.positions.focus, here - off) - plane));
    position.bound = position.bound + Dioptres{reach};
  }
  for (std::size_t j = 0; j < planning.iris.size() && motors.iris; ++j) {
    positions.iris[j] = OpenAt(optics, planning.iris[j], motors.iris->BoundAt(planning.iris[j]));
  }
  return positions;
}

MotorPositions Positions(const Planning& planning, const MotorsNow& motors) {
  optics::LensPositions lens = WithMotors(planning, motors);
  optics::FocusBlocks blocks(lens.focus);
  return {std::move(lens), std::move(blocks)};
}

}  // namespace

MotorPositions MotorPositionsOf(const Planning& planning, const rig::Status& now) {
  return Positions(planning, MotorsOf(planning, now));
}

std::shared_ptr<const MotorPositions> MotorPositionsCache::Of(const Planning& planning, const rig::Status& now) const {
  MotorsNow motors = MotorsOf(planning, now);
  std::shared_ptr<const Worked> worked;
  {
    const std::scoped_lock lock(mutex_);
    worked = last_;
  }
  if (!worked || worked->from != motors) {
    worked = std::make_shared<const Worked>(motors, Positions(planning, motors));
    const std::scoped_lock lock(mutex_);
    last_ = worked;
  }
  return {worked, &worked->positions};
}

double ZoomErrorNow(const rig::OpticsTable& optics, const rig::Status& now) {
  const auto& zoom = now.axes[Axis::Zoom];
  return optics.has_zoom() && zoom ? ZoomError(optics, zoom->position, zoom->bound) : 0.0;
}

Dioptres ZoomShift(const FocusPosition& position, double error) {
  if (error == 0.0) return {};
  const auto shift = [&](double factor) {
    return std::abs(
        (optics::FocalPlane(position.focal_length * factor, position.extension) - position.focal_plane).value);
  };
  return Dioptres{std::max(shift(1.0 + error), shift(1.0 - error))};
}

optics::IrisPosition OpenAt(const rig::OpticsTable& optics, Native native, Native bound) {
  const FNumber low = optics.FNumberFromNative(native - bound), high = optics.FNumberFromNative(native + bound);
  const double error = optics.FNumberError();
  return {.f_number = optics.FNumberFromNative(native),
          .lowest = std::min(low, high) * (1.0 - error),
          .highest = std::max(low, high) * (1.0 + error)};
}

}  // namespace lensd::daemon
