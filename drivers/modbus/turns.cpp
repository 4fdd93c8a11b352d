// The drives in turn; those that are not there by the time since one of them was asked.
#include "turns.h"

#include <algorithm>

#include "bus.h"

namespace lensd::drivers::modbus {
namespace {

constexpr int kLostAfter = 5;                                    ///< bad exchanges in a row: the drive is not there
constexpr Duration kLostPause = std::chrono::milliseconds(250);  ///< between questions to drives that are not there
constexpr int kAbsentShare = 10;  ///< response timeouts, that pause where others of the bus are there
constexpr int kFirstShare = 2;    ///< as above, for a unit that was never asked

/// A caller asks for it.
bool HasWork(const BusSlot& seat) {
  return seat.order || seat.looks_answered < seat.looks_asked;
}

}  // namespace

Turns::Unit Turns::Of(const BusSlot& seat) const {
  const auto found = units_.find(seat.drive->config().unit);
  return found == units_.end() ? Unit{} : found->second;
}

bool Turns::Absent(const BusSlot& seat) const {
  const Unit unit = Of(seat);
  return !unit.heard || unit.failures >= kLostAfter;
}

bool Turns::Missed(const BusSlot& seat) const {
  return Absent(seat) && Of(seat).failures > 0;
}

void Turns::Answered(const BusSlot& seat) {
  units_[seat.drive->config().unit] = {.heard = true};
}

void Turns::Failed(const BusSlot& seat, Instant now) {
  Unit& unit = units_[seat.drive->config().unit];
  ++unit.failures;
  unit.asked_at = now;
  if (Absent(seat)) absent_asked_at_ = now;
}

Instant Turns::MayBeAsked(const BusSlot& seat, Seats seats) const {
  const bool others = std::ranges::any_of(seats, [this](const BusSlot* other) { return !Absent(*other); });
  const bool first = Of(seat).failures == 0;
  const Duration among_others = (first ? kFirstShare : kAbsentShare) * response_timeout_;
  return absent_asked_at_ + (others ? among_others : first ? Duration{} : kLostPause);
}

/// Of those that are not there the one asked longest ago, when it is time for one; otherwise the next after the last.
BusSlot* Turns::Next(Seats seats, Instant now) const {
  BusSlot* absent = nullptr;
  BusSlot* next = nullptr;
  const auto last = std::ranges::find(seats, last_);
  const std::size_t begin = last == seats.end() ? 0 : static_cast<std::size_t>(last - seats.begin()) + 1;
  for (std::size_t i = 0; i < seats.size(); ++i) {
    BusSlot* const seat = seats[(begin + i) % seats.size()];
    if (!HasWork(*seat)) continue;
    if (!Absent(*seat)) {
      if (next == nullptr) next = seat;
    } else if (now >= MayBeAsked(*seat, seats) && (absent == nullptr || Of(*seat).asked_at < Of(*absent).asked_at)) {
      absent = seat;
    }
  }
  return absent != nullptr ? absent : next;
}

std::optional<Instant> Turns::NextAbsent(Seats seats) const {
  std::optional<Instant> next;
  for (const BusSlot* const seat : seats) {
    if (!HasWork(*seat) || !Absent(*seat)) continue;
    const Instant at = MayBeAsked(*seat, seats);
    next = next ? std::min(*next, at) : at;
  }
  return next;
}

}  // namespace lensd::drivers::modbus
