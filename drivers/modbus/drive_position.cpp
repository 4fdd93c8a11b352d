// What a drive says of its position, and whether that can be one.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iomanip>
#include <sstream>
#include <utility>

#include "drive.h"

namespace lensd::drivers::modbus {
namespace {

constexpr std::int64_t kCounter = 65536;  ///< numbers of a counter of 16 bits
constexpr double kOvershoot = 0.02;       ///< of a move: a servo may pass its target by so much

std::string NumberText(double number) {
  std::ostringstream text;
  text << std::setprecision(15) << number;
  return text.str();
}

/// Its two registers the other way round.
std::int64_t Swapped(std::int64_t number, NumberType type) {
  const auto both = static_cast<std::uint32_t>(number);
  const std::uint16_t registers[] = {static_cast<std::uint16_t>(both & 0xFFFF), static_cast<std::uint16_t>(both >> 16)};
  return NumberAt(registers, type, WordOrder::HighFirst);
}

}  // namespace

Result<void> Drive::ReadPosition(RegisterAccess& talk, Seen& seen) {
  const auto position = talk.ReadNumber(config_.profile.position, config_.profile.word_order);
  if (!position) return PassOn(position);
  seen.read = *position;
  seen.counts = static_cast<double>(*position) * config_.profile.position_scale;
  seen.position = std::llround(seen.counts);
  return {};
}

/// A counter of 16 bits shows the target, and goes on, where the target is further by as much as it has numbers. So it
/// is where a motion from rest goes past its target, and no reading so far says that the counter has more bits, though
/// the range needs them.
bool Drive::MayWrap(const Seen& seen) {
  odd_.lowest = std::min(odd_.lowest, seen.read);
  odd_.highest = std::max(odd_.highest, seen.read);
  const bool narrow =
      RegistersOf(config_.profile.position.type) == 2 &&
      ((odd_.lowest >= 0 && odd_.highest < kCounter) || (odd_.lowest >= -kCounter / 2 && odd_.highest < kCounter / 2));
  const double numbers = std::abs((config_.high - config_.low) / (config_.scale * config_.profile.position_scale));
  const double from = doing_.began_at.value_or(seen.counts), to = static_cast<double>(doing_.goal.target);
  const double beyond = std::copysign(1.0, to - from) * (seen.counts - to);
  const double near = 8.0 * std::max(1.0, static_cast<double>(config_.profile.arrival_counts));
  const bool shown = watch_.live() || clock_.Now() > doing_.since + drivers::kRegisterLag;
  const bool passes = narrow && numbers >= static_cast<double>(kCounter) && doing_.from_rest && shown && seen.moving &&
                      beyond > std::max(near, kOvershoot * std::abs(to - from));
  odd_.passed = passes ? odd_.passed + 1 : 0;
  return odd_.passed >= 2;
}

/// Why positions cannot be right; empty where they can. A drive may well stand outside its range, but not in a place
/// that is one of the range once its two registers are read in the other order; nor can it jump far, or back by exactly
/// as much as a counter of 16 bits has numbers. What is far outside must be read twice.
std::string Drive::WhatIsOdd(const Seen& seen) {
  const double range = config_.high - config_.low;
  const auto within = [&](double counts, double room) {
    const double native = counts * config_.scale;
    return native >= config_.low - room && native <= config_.high + room;
  };
  const bool moves = doing_.phase == Phase::Starting || doing_.phase == Phase::Going;
  const auto before = std::exchange(odd_.read_before, seen.read);
  const std::int64_t jump = before ? seen.read - *before : 0;
  const double onward = static_cast<double>(doing_.goal.target) - believed_.value_or(0.0);
  const double jumped_by = static_cast<double>(jump) * config_.profile.position_scale;
  const bool back = jumped_by * onward <= 0.0 || jump * odd_.last_step < 0;
  const bool astray = back || std::abs(jumped_by) > std::abs(onward) + 1.0;
  const auto by_counter = [](std::int64_t step) { return std::llabs(std::llabs(step) - kCounter) < kCounter / 8; };
  // A jump toward the target, after which the drive goes on away from it.
  const bool turned = jump * odd_.last_step < 0 && by_counter(odd_.last_step) && !by_counter(jump);
  const std::int64_t came_from = turned ? *before - odd_.last_step : before.value_or(0);
  if (jump != 0) odd_.last_step = jump;
  // Such a counter never shows more than it has, and one reading alone may be wrong.
  const auto counter_has = [](std::int64_t a, std::int64_t b) {
    return (std::min(a, b) >= 0 && std::max(a, b) < kCounter) ||
           (std::min(a, b) >= -kCounter / 2 && std::max(a, b) < kCounter / 2);
  };
  const auto suspected = std::exchange(odd_.wrapped, std::nullopt);
  const bool stays = suspected && std::llabs(seen.read - suspected->to) < kCounter / 8;
  const bool back_again = odd_.jumped_from && std::llabs(seen.read - *odd_.jumped_from) < kCounter / 8;
  odd_.jumped_from = by_counter(jump) && !back_again ? before : std::nullopt;
  if (astray && by_counter(jump) && !back_again && counter_has(*before, seen.read)) {
    odd_.wrapped = Wrapped{*before, seen.read};
  }
  const bool turned_wraps = turned && counter_has(came_from, *before);
  if (moves && doing_.goal.kind == Order::Kind::Move && (stays || turned_wraps)) {
    return "its position went from " + std::to_string(stays ? suspected->from : came_from) + " to " +
           std::to_string(stays ? suspected->to : *before) +
           " between two readings: the drive's counter wraps at 16 bits; keep its range within what it can count";
  }
  if (MayWrap(seen) && moves && doing_.goal.kind == Order::Kind::Move) {
    return "its position went past its target, " + std::to_string(doing_.goal.target) + ", and on to " +
           std::to_string(seen.position) + ", while its range is wider than 16 bits: the drive's counter wraps at 16 " +
           "bits, or another program has sent it on; keep its range within what it can count";
  }
  const bool jumped = believed_ && within(*believed_, range) && moves;
  odd_.readings = within(seen.counts, range) ? 0 : odd_.readings + 1;
  odd_.jumped = odd_.readings == 1 ? jumped : odd_.jumped;
  if (odd_.readings < 2) return {};
  const Profile& profile = config_.profile;
  const std::string reads = "its position reads " + NumberText(seen.counts * config_.scale) +
                            ", far outside its range " + NumberText(config_.low) + " to " + NumberText(config_.high);
  const double swapped = static_cast<double>(Swapped(seen.read, profile.position.type)) * profile.position_scale;
  if (RegistersOf(profile.position.type) == 2 && within(swapped, 0.0)) {
    return reads + ", and " + NumberText(swapped * config_.scale) +
           " with its two registers in the other order: set word_order = \"" +
           (profile.word_order == WordOrder::HighFirst ? "low-first" : "high-first") + "\"";
  }
  if (!odd_.jumped) return {};
  return reads +
         ", between two readings: [position] of its profile has another address or width than the drive, or its "
         "counter wraps";
}

}  // namespace lensd::drivers::modbus
