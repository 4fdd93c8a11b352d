// A lens whose axes are drives of one bus. It only hands on: the bus thread owns the drives and their state.
#include "modbus_lens.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "drivers/api/thread_barrier.h"

namespace lensd::drivers::modbus {
namespace {

using drivers::Axis;

std::string LabelOf(const DriveConfig& drive, const Bus& bus) {
  return std::string(AxisName(drive.axis)) + " (unit " + std::to_string(drive.unit) + " on bus " + bus.config().name +
         ")";
}

/// The targets that its registers hold, where nothing but the count tells where the axis stands: after a loss of power
/// the travel may lie anywhere among them.
std::optional<std::pair<Native, Native>> CountsOf(const DriveConfig& drive) {
  const Profile& profile = drive.profile;
  if (profile.feedback != Feedback::Counts || !profile.home.empty()) return std::nullopt;
  double low = -std::numeric_limits<double>::infinity(), high = -low;
  const auto hold = [&](NumberType type, double native_per_count) {
    const auto [least, most] = LimitsOf(type);
    const auto [one, other] =
        std::minmax({native_per_count * static_cast<double>(least), native_per_count * static_cast<double>(most)});
    low = std::max(low, one);
    high = std::min(high, other);
  };
  hold(profile.position.type, drive.scale * profile.position_scale);
  for (const WriteStep& step : profile.move) {
    for (const Field& field : step.fields) {
      if (field.name == "target") hold(field.type, drive.scale);
    }
  }
  return std::pair(Native{std::min(low, drive.low)}, Native{std::max(high, drive.high)});
}

drivers::Capabilities CapabilitiesOf(const std::vector<DriveConfig>& drives, const Bus& bus) {
  drivers::Capabilities can{.driver = "modbus", .model = drives.front().profile.name, .serial = "", .axes = {}};
  for (const DriveConfig& drive : drives) {
    if (drive.profile.name != can.model) can.model += ", " + drive.profile.name;
    can.serial += (can.serial.empty() ? "" : "+") + std::to_string(drive.unit);
    drivers::AxisCapabilities axis;  // which way a motor turns a lens is up to who mounted it: no direction is known
    axis.minimum = Native{drive.low};
    axis.maximum = Native{drive.high};
    axis.resolution = std::abs(drive.scale) * std::max(1.0, std::abs(drive.profile.position_scale));
    axis.counts = CountsOf(drive);
    axis.feedback = drive.profile.feedback;
    axis.can_home = !drive.profile.home.empty();
    axis.needs_home = drive.profile.homing_required;
    axis.can_stop = !drive.profile.stop.empty();
    axis.speed = drive.speed;
    axis.settle = drive.settle;
    can.axes[drive.axis] = axis;
  }
  can.serial = bus.config().Endpoint() + "#" + can.serial;
  return can;
}

}  // namespace

ModbusLens::ModbusLens(std::shared_ptr<Bus> bus, std::vector<DriveConfig> drives, const Clock& clock)
    : Lens(CapabilitiesOf(drives, *bus)), bus_(std::move(bus)) {
  for (DriveConfig& drive : drives) {
    std::string label = LabelOf(drive, *bus_);
    seats_.push_back(std::make_unique<BusSlot>(std::make_unique<Drive>(std::move(drive), std::move(label), clock)));
    bus_->Add(*seats_.back());
  }
}

ModbusLens::~ModbusLens() {
  for (const auto& seat : seats_) {
    const Axis axis = seat->drive->config().axis;
    if (may_move_[axis] && capabilities().axes[axis]->can_stop) {
      Contain([&] { (void)bus_->Stop(*seat, interrupts_); });
    }
  }
  for (const auto& seat : seats_) bus_->Remove(*seat);
}

std::uint64_t ModbusLens::DoCountBusErrors() const {
  std::uint64_t count = 0;
  for (const auto& seat : seats_) count += seat->bad_exchanges;
  return count;
}

BusSlot& ModbusLens::SeatOf(Axis axis) {
  return **std::ranges::find_if(seats_, [&](const auto& seat) { return seat->drive->config().axis == axis; });
}

Result<void> ModbusLens::DoStartHome(Axis axis) {
  may_move_[axis] = true;
  return bus_->Give(SeatOf(axis), {.kind = Order::Kind::Home, .target = 0}, interrupts_);
}

Result<void> ModbusLens::DoStartMove(Axis axis, Native target) {
  BusSlot& seat = SeatOf(axis);
  may_move_[axis] = true;
  const double counts = std::round(target.value / seat.drive->config().scale);
  return bus_->Give(seat, {.kind = Order::Kind::Move, .target = static_cast<std::int64_t>(counts)}, interrupts_);
}

Result<drivers::LensState> ModbusLens::DoRead() {
  auto samples = bus_->Look(seats_, interrupts_);
  if (!samples) return PassOn(samples);
  drivers::LensState state;
  state.sampled_at = std::ranges::min(*samples, {}, &Sample::at).at;
  for (std::size_t i = 0; i < seats_.size(); ++i) {
    const Axis axis = seats_[i]->drive->config().axis;
    may_move_[axis] = (*samples)[i].state.moving;
    state.axes[axis] = std::move((*samples)[i].state);
  }
  return state;
}

Result<void> ModbusLens::DoStop(Axis axis) {
  return bus_->Stop(SeatOf(axis), interrupts_);
}

Result<void> ModbusLens::DoResetFault(Axis axis) {
  return bus_->Give(SeatOf(axis), {.kind = Order::Kind::Reset, .target = 0}, interrupts_);
}

void ModbusLens::DoCutReadShort() {
  bus_->Interrupt(interrupts_, Bus::Calls::Looks);
}

void ModbusLens::DoInterrupt() {
  bus_->Interrupt(interrupts_, Bus::Calls::All);
}

}  // namespace lensd::drivers::modbus
