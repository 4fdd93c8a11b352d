// What a lens asks of its bus, on the lens' own thread: orders, stops and looks are left for the bus' thread, and
// their answers awaited.
#include <algorithm>

#include "bus.h"

namespace lensd::drivers::modbus {
namespace {

constexpr Duration kFreshWait =
    std::chrono::milliseconds(100);                           ///< Look() waits so long before an older sample will do
constexpr Duration kOldest = std::chrono::milliseconds(250);  ///< how old that may be

}  // namespace

Error Bus::NotInTime(const BusSlot& seat, const std::string& what) {
  if (turns_.Missed(seat)) return Error{Code::Disconnected, seat.drive->label() + " does not answer"};
  return Error{Code::Timeout, seat.drive->label() + " could not be " + what + " in time: the bus is busy"};
}

Duration Bus::IoDeadline() const {
  return std::chrono::seconds(1) + 4 * config_.response_timeout;
}

void Bus::Interrupt(Interrupts& interrupts, Calls calls) {
  const std::lock_guard lock(mutex_);
  ++(calls == Calls::All ? interrupts.count : interrupts.looks);
  answers_.notify_all();
}

Result<void> Bus::Give(BusSlot& seat, const Order& order, const Interrupts& interrupts) {
  std::unique_lock lock(mutex_);
  const auto before = interrupts.count;
  const auto number = ++seat.orders_asked;
  seat.order = order;
  seat.newest.reset();
  if (seat.stop_busy_since) {  // the newest command wins over a stop that the drive was too busy to take
    seat.stop = false;
    seat.stops_answered = seat.stops_asked;
    seat.stop_answer = Fail(Code::Cancelled, "a newer command took over");
    seat.stop_busy_since.reset();
  }
  wake_.notify_all();
  const auto answered = [&] { return seat.orders_answered >= number; };
  answers_.wait_until(lock, clock_.Now() + IoDeadline(), [&] { return answered() || interrupts.count != before; });
  seat.barrier.Check();
  if (answered()) return seat.order_answer;
  seat.order.reset();
  if (seat.order_taken) seat.withdrawn = true;
  if (interrupts.count != before) return Fail(Code::Cancelled, "interrupted");
  return PassOn(NotInTime(seat, "told"));
}

Result<void> Bus::Stop(BusSlot& seat, const Interrupts& interrupts) {
  std::unique_lock lock(mutex_);
  const auto before = interrupts.count;
  const auto number = ++seat.stops_asked;
  seat.stop = true;
  seat.stop_at = {};
  seat.stop_busy_since.reset();
  seat.order.reset();
  seat.newest.reset();
  wake_.notify_all();
  const auto answered = [&] { return seat.stops_answered >= number; };
  answers_.wait_until(lock, clock_.Now() + IoDeadline(), [&] { return answered() || interrupts.count != before; });
  seat.barrier.Check();
  if (answered()) return seat.stop_answer;
  if (interrupts.count != before) return Fail(Code::Cancelled, "interrupted; the stop is sent nevertheless");
  return PassOn(NotInTime(seat, "stopped"));
}

Result<std::vector<Sample>> Bus::Look(std::span<const std::unique_ptr<BusSlot>> seats, const Interrupts& interrupts) {
  std::unique_lock lock(mutex_);
  const auto before = interrupts.count, looks_before = interrupts.looks;
  const auto interrupted = [&] { return interrupts.count != before || interrupts.looks != looks_before; };
  const Instant now = clock_.Now();
  for (const auto& seat : seats) ++seat->looks_asked;
  wake_.notify_all();
  std::vector<std::uint64_t> numbers;
  for (const auto& seat : seats) numbers.push_back(seat->looks_asked);
  const auto answered = [&](std::size_t i) { return seats[i]->looks_answered >= numbers[i]; };
  const auto settled = [&] {
    bool all = true;
    for (std::size_t i = 0; i < seats.size(); ++i) {
      if (answered(i) && !seats[i]->look_answer) return true;
      all = all && answered(i);
    }
    return all || interrupted();
  };
  const auto recent = [&](const auto& seat) { return seat->newest && clock_.Now() - seat->newest->at < kOldest; };
  answers_.wait_until(lock, now + kFreshWait, settled);
  if (!settled() && !std::ranges::all_of(seats, recent)) answers_.wait_until(lock, now + IoDeadline(), settled);
  for (const auto& seat : seats) seat->barrier.Check();
  for (std::size_t i = 0; i < seats.size(); ++i) {
    if (answered(i) && !seats[i]->look_answer) return PassOn(seats[i]->look_answer);
  }
  if (interrupted()) return Fail(Code::Cancelled, "interrupted");
  std::vector<Sample> samples;
  for (std::size_t i = 0; i < seats.size(); ++i) {
    if (!answered(i) && !recent(seats[i])) {
      return PassOn(NotInTime(*seats[i], "asked"));
    }
    samples.push_back(answered(i) ? *seats[i]->look_answer : *seats[i]->newest);
  }
  return samples;
}

}  // namespace lensd::drivers::modbus
