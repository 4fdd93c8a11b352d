// Thousands of moves of four axes on one bus while exchanges go wrong at random: every move ends, what is called
// reached is, and no answer is taken for another's.
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cmath>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <thread>
#include <vector>

#include "modbus_bench.h"
#include "rig/rig.h"
#include "test_level.h"

namespace lensd::drivers::modbus {
namespace {

using sim::WireFault;

constexpr double kRange = 2000.0;

struct Tally {
  long moves = 0, reached = 0, refused = 0, failed = 0, stopped = 0, wrong_position = 0, false_reached = 0, hung = 0,
       spoiled = 0;
  Duration longest{};
  std::map<std::string, long> reasons;

  Tally& operator+=(const Tally& other) {
    moves += other.moves;
    reached += other.reached;
    refused += other.refused;
    failed += other.failed;
    stopped += other.stopped;
    spoiled += other.spoiled;
    hung += other.hung;
    wrong_position += other.wrong_position;
    false_reached += other.false_reached;
    longest = std::max(longest, other.longest);
    for (const auto& [reason, count] : other.reasons) reasons[reason] += count;
    return *this;
  }
};

/// Where the positions of a drive lie: nowhere another's do, and no status looks like one.
double BaseOf(int unit) {
  return 1e6 * unit;
}

/// One lens of two drives, driven as the daemon's worker does.
class Driver {
 public:
  Driver(Bench& bench, std::array<int, 2> units, std::uint64_t seed) : bench_(bench), units_(units), random_(seed) {}

  /// Homes both drives, patiently: a busy machine may keep a drive from answering in the time that the moves give it.
  bool Home() {
    auto device = Connect(kPatient);
    if (!device) return false;
    for (const Axis axis : {Axis::Focus, Axis::Iris}) {
      bool homed = false;
      for (int tries = 0; tries < 5 && !homed; ++tries) {
        homed = device->lens->StartHome(axis) &&
                bench_.Until(*device->lens, axis, [](const AxisState& state) { return !state.moving && state.homed; });
      }
      if (!homed) return false;
      bench_.wire.With(UnitOf(axis),
                       [&](sim::ModbusDrive& drive, Duration now) { drive.SetCount(now, BaseOf(UnitOf(axis))); });
    }
    return true;
  }

  /// Repeated, since a drive that is late on a busy machine is not opened.
  void Open() {
    std::string reason;
    for (int tries = 0; tries < 20 && !rig_; ++tries) {
      auto device = Connect("response_timeout_ms = 30");
      auto made = device ? rig::Rig::Create({}, *std::move(device), bench_.clock) : std::unexpected(device.error());
      if (made) {
        rig_ = *std::move(made);
      } else {
        reason = made.error().message;
      }
    }
    ASSERT_TRUE(rig_) << reason;
  }

  void Run(long moves) {
    for (long i = 0; i < moves && tally.hung == 0; ++i) MoveOnce();
  }
  Tally tally;

 private:
  Result<Device> Connect(const std::string& timeout) {
    auto drive = [](const std::string& axis, int unit) {
      return FastAz(axis, unit,
                    "[" + std::to_string(BaseOf(unit)) + ", " + std::to_string(BaseOf(unit) + kRange) + "]");
    };
    return bench_.Open(drive("focus", units_[0]) + drive("iris", units_[1]), timeout);
  }
  int UnitOf(Axis axis) const { return units_[axis == Axis::Focus ? 0 : 1]; }

  void MoveOnce() {
    const Axis axis = random_() % 2 == 0 ? Axis::Focus : Axis::Iris;
    const double target = BaseOf(UnitOf(axis)) + static_cast<double>(random_() % static_cast<unsigned>(kRange + 1));
    std::optional<Result<rig::MoveOutcome>> end;
    rig_->Move(axis, {.kind = rig::Target::Kind::Native, .value = target, .from = {}},
               [&](Result<rig::MoveOutcome> outcome) { end = std::move(outcome); });
    const Instant began = bench_.clock.Now();
    const bool stop = random_() % 10 == 0;
    const Duration stop_after = std::chrono::milliseconds(random_() % 60);
    bool stop_sent = false;
    ++tally.moves;
    bool spoiled = false;
    const Duration spoil_after = std::chrono::milliseconds(random_() % 60);
    while (!end) {
      Step();
      const Duration gone = bench_.clock.Now() - began;
      if (!spoiled && gone > spoil_after) {
        spoiled = true;
        Spoil(UnitOf(axis));
      }
      if (stop && !stop_sent && gone > stop_after && !end) {
        stop_sent = true;
        ++tally.stopped;
        rig_->Stop({axis}, [](Result<void>) {});
      }
      if (gone > std::chrono::seconds(30)) {
        ++tally.hung;
        return;
      }
    }
    tally.longest = std::max(tally.longest, bench_.clock.Now() - began);
    Judge(axis, target, *end);
    // Nothing is learnt from a lens that is known to be away.
    const Instant patience = bench_.clock.Now() + std::chrono::seconds(3);
    while (!rig_->GetStatus().connected && bench_.clock.Now() < patience) Step();
  }

  /// Now and then a drive is without power for a moment, or reads as it was.
  void Spoil(int unit) {
    const auto kind = random_() % 25;
    const Duration how_long = std::chrono::milliseconds(random_() % 400);
    if (kind > 1) return;
    ++tally.spoiled;
    bench_.wire.With(unit, [&](sim::ModbusDrive& drive, Duration now) {
      kind == 0 ? drive.LosePower(now, how_long) : drive.Freeze(now, how_long);
    });
  }

  void Step() {
    const Instant next = rig_->Step(bench_.clock.Now());
    const auto status = rig_->GetStatus();
    for (const Axis axis : {Axis::Focus, Axis::Iris}) {
      if (!status.axes[axis]) continue;
      const double at = status.axes[axis]->position.value - BaseOf(UnitOf(axis));
      if (at >= -1.0 && at <= kRange + 1.0) continue;
      ++tally.wrong_position;
      tally.reasons["unit " + std::to_string(UnitOf(axis)) + " said to be at " +
                    std::to_string(status.axes[axis]->position.value)]++;
    }
    std::this_thread::sleep_until(std::min(next, bench_.clock.Now() + std::chrono::milliseconds(2)));
  }

  void Judge(Axis axis, double target, const Result<rig::MoveOutcome>& end) {
    if (!end) {
      ++tally.failed;
      ++tally.reasons[end.error().message];
    } else if (!end->reached) {
      ++tally.refused;
      ++tally.reasons[end->reason];
    } else {
      ++tally.reached;
      if (std::abs(bench_.Count(UnitOf(axis)) - target) > 1.0) ++tally.false_reached;
    }
  }

  Bench& bench_;
  const std::array<int, 2> units_;
  std::mt19937_64 random_;
  std::unique_ptr<rig::Rig> rig_;
};

class ModbusFaults : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Wire, ModbusFaults, ::testing::Bool(),
                         [](const auto& serial) { return serial.param ? "Rtu" : "Tcp"; });

/// Four drives on one wire that errs at random, driven as two lenses.
class FaultyBus {
 public:
  FaultyBus(bool serial, unsigned seed)
      : bench(serial, {"oriental-az", "oriental-az", "oriental-az", "oriental-az"}),
        one(bench, {1, 2}, 2 * seed + 1),
        other(bench, {3, 4}, 2 * seed + 2),
        seed_(seed) {}

  void Run(long moves_of_each) {
    ASSERT_TRUE(one.Home() && other.Home());
    one.Open();
    other.Open();
    if (::testing::Test::HasFatalFailure()) return;
    bench.wire.SetLate(std::chrono::milliseconds(50));
    bench.wire.SetRandomFaults({{WireFault::NoReply, 0.004},
                                {WireFault::Deaf, 0.004},
                                {WireFault::Late, 0.008},
                                {WireFault::BadCrc, 0.004},
                                {WireFault::Short, 0.004},
                                {WireFault::WrongUnit, 0.004},
                                {WireFault::Exception, 0.004},
                                {WireFault::Split, 0.01},
                                {WireFault::Noise, 0.004},
                                {WireFault::Ignore, 0.01}},
                               7 + seed_);
    const std::jthread first([&] { one.Run(moves_of_each); });
    const std::jthread second([&] { other.Run(moves_of_each); });
  }
  Bench bench;
  Driver one, other;

 private:
  const unsigned seed_;
};

TEST_P(ModbusFaults, FourAxesOfOneBus) {
  // They wait for their drives nearly all the time, so several buses run beside each other.
  constexpr unsigned kBuses = 5;
  std::vector<std::unique_ptr<FaultyBus>> buses;
  for (unsigned seed = 0; seed < kBuses; ++seed) buses.push_back(std::make_unique<FaultyBus>(GetParam(), seed));
  // Half of the 10,000 over either wire at each level.
  const long moves = testing::ByLevel(40, 250, 5000) / (2 * kBuses);
  {
    std::vector<std::jthread> running;
    for (auto& bus : buses) running.emplace_back([&bus, moves] { bus->Run(moves); });
  }
  Tally all;
  long exchanges = 0, faults = 0;
  for (auto& bus : buses) {
    exchanges += bus->bench.wire.requests();
    faults += bus->bench.wire.faults();
    all += bus->one.tally;
    all += bus->other.tally;
  }
  std::cout << all.moves << " moves, " << exchanges << " exchanges, " << faults << " faults on the wire, "
            << all.spoiled << " of drives: " << all.reached << " reached, " << all.refused << " not reached, "
            << all.failed << " failed (" << all.stopped << " stopped), longest "
            << std::chrono::duration<double>(all.longest).count() << " s\n";
  for (const auto& [reason, count] : all.reasons) std::cout << "  " << count << " x " << reason << "\n";
  EXPECT_EQ(all.hung, 0);
  EXPECT_EQ(all.wrong_position, 0);
  EXPECT_EQ(all.false_reached, 0);
  EXPECT_GT(all.reached, all.moves / 2);
}

}  // namespace
}  // namespace lensd::drivers::modbus
