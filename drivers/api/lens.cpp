// The checking half of a lens: axis there, target finite and in range, before a driver's own code is called. Drivers
// may rely on it.
#include "drivers/api/lens.h"

#include <cmath>
#include <sstream>

namespace lensd::drivers {
namespace {

constexpr std::array<std::string_view, kAxes.size()> kAxisNames = {"focus", "iris", "zoom", "filter"};

}  // namespace

std::string_view AxisName(Axis axis) {
  return kAxisNames[static_cast<std::size_t>(axis)];
}

std::optional<Axis> AxisFromName(std::string_view name) {
  for (const Axis axis : kAxes) {
    if (AxisName(axis) == name) return axis;
  }
  return std::nullopt;
}

std::string_view NativeUnitName(NativeUnit unit) {
  static constexpr std::string_view kNames[] = {"steps", "dioptres", "f-number", "millimetres", "position"};
  return kNames[static_cast<std::size_t>(unit)];
}

Result<const AxisCapabilities*> Lens::Find(Axis axis) const {
  const auto& found = capabilities_.axes[axis];
  if (!found) return Fail(Code::Unsupported, "this lens has no motorised " + std::string(AxisName(axis)));
  return &*found;
}

Result<void> Lens::StartHome(Axis axis) {
  const auto found = Find(axis);
  if (!found) return PassOn(found);
  if (!(*found)->can_home) return Fail(Code::Unsupported, std::string(AxisName(axis)) + " has no reference to home to");
  return Noted(DoStartHome(axis));
}

Result<void> Lens::StartMove(Axis axis, Native target) {
  const auto found = Find(axis);
  if (!found) return PassOn(found);
  if (!std::isfinite(target.value)) return Fail(Code::InvalidArgument, "a target must be a finite number");
  const AxisCapabilities& can = **found;
  if (target < can.lowest_count() || target > can.highest_count()) {
    std::ostringstream message;
    message << AxisName(axis) << " target " << target.value << " is outside " << can.lowest_count().value << ".."
            << can.highest_count().value << " " << NativeUnitName(can.unit);
    return Fail(Code::OutOfRange, message.str());
  }
  return Noted(DoStartMove(axis, target));
}

Result<LensState> Lens::Read() {
  return Noted(DoRead());
}

Result<void> Lens::Stop(Axis axis) {
  const auto found = Find(axis);
  if (!found) return PassOn(found);
  if (!(*found)->can_stop) return Fail(Code::Unsupported, std::string(AxisName(axis)) + " cannot stop midway");
  return Noted(DoStop(axis));
}

Result<void> Lens::DoResetFault(Axis axis) {
  return Fail(Code::Unsupported, "this lens takes no command to reset a fault of " + std::string(AxisName(axis)));
}

Result<void> Lens::ResetFault(Axis axis) {
  const auto found = Find(axis);
  if (!found) return PassOn(found);
  return Noted(DoResetFault(axis));
}

}  // namespace lensd::drivers
