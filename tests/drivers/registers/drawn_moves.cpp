#include "drawn_moves.h"

#include <iostream>
#include <optional>
#include <utility>

#include "rig/rig.h"

namespace lensd::testing {
namespace {

using drivers::Axis;
using std::chrono::milliseconds;

constexpr long kEach = 20;  ///< moves of one device

class Draw {
 public:
  explicit Draw(std::mt19937_64& random) : random_(random) {}
  double Uniform(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
  double LogUniform(double low, double high) { return std::exp(Uniform(std::log(low), std::log(high))); }
  bool OneIn(int of) { return std::uniform_int_distribution(1, of)(random_) == 1; }

  DeviceKind Truthful() {
    DeviceKind kind;
    kind.speed = LogUniform(20.0, 50000.0);
    kind.range = std::round(std::min(LogUniform(100.0, 60000.0), 8.0 * kind.speed));
    kind.starts_after = OneIn(2) ? 0.0 : Uniform(0.0, 5.0);
    return kind;
  }
  DeviceKind Any() {
    DeviceKind kind = Truthful();
    const auto time = [&] { return OneIn(3) ? 0.0 : OneIn(2) ? LogUniform(0.2, 400.0) : Uniform(0.2, 400.0); };
    kind.echo = time();
    kind.stale = time();
    kind.stale_first = OneIn(2);
    kind.varies = OneIn(2);
    kind.busy = static_cast<DeviceKind::Busy>(std::uniform_int_distribution(0, 3)(random_));
    kind.busy_off = LogUniform(0.2, 400.0);
    if (!OneIn(3)) Lie(kind);
    return kind;
  }

 private:
  /// Live at first, and then not: by one reading at any time, in motion or at rest, or for up to 400 ms.
  void Lie(DeviceKind& kind) {
    if (!OneIn(3)) kind.echo = kind.stale = 0.0;
    if (OneIn(3)) kind.busy = DeviceKind::Busy::True;
    kind.lies_once = OneIn(2);
    // A place that none can be, twice, is a fault, and not this test's.
    kind.lie = static_cast<DeviceKind::Lie>(std::uniform_int_distribution(1, kind.lies_once ? 4 : 3)(random_));
    kind.lie_begins = kind.lies_once ? LogUniform(1.0, 3000.0) : Uniform(0.0, 400.0);
    kind.lie_lasts = LogUniform(1.0, 400.0);
  }

  std::mt19937_64& random_;
};

class Moves {
 public:
  Moves(const MakeLens& make, const DeviceKind& kind, std::mt19937_64& random, MoveTally& tally)
      : draw_(random), device_(kind, random), tally_(tally) {
    rig::RigConfig config;
    if (draw_.OneIn(2)) config.axes[Axis::Focus].speed = kind.speed;
    config.axes[Axis::Focus].backlash = 0.0;
    clock_.Advance(std::chrono::hours(1));
    drivers::Device device;
    device.lens = make(device_, clock_, random);
    rig_ = rig::Rig::Create(config, std::move(device), clock_).value();
  }

  void Ordinary() {
    Begin();
    Await();
    Idle(draw_.Uniform(0.0, 1000.0));
  }

  void Any() {
    Begin();
    if (draw_.OneIn(6)) {
      Idle(draw_.LogUniform(1.0, 1000.0));
      draw_.OneIn(2) ? Stop() : Begin();
    }
    Await();
    Idle(draw_.OneIn(3) ? 0.0 : draw_.LogUniform(1.0, 2000.0));
  }

 private:
  struct Move {
    double target = 0.0;
    bool ended = false;
  };

  void Begin() {
    const double range = device_.kind().range;
    double target = std::round(draw_.Uniform(0.0, range));
    if (draw_.OneIn(3)) {  // a short one
      const double by = std::round(draw_.LogUniform(1.0, std::max(2.0, 0.1 * range)));
      target = std::clamp(target_ + (draw_.OneIn(2) ? by : -by), 0.0, range);
    }
    if (move_ && !move_->ended) ++tally_.retargeted;
    target_ = target;
    auto move = std::make_shared<Move>(Move{.target = target});
    move_ = move;
    ++tally_.moves;
    begun_at_ = clock_.Now();
    from_ = device_.Shaft(begun_at_);
    rig_->Move(Axis::Focus, {.kind = rig::Target::Kind::Native, .value = target, .from = {}},
               [this, move](Result<rig::MoveOutcome> end) { Judge(*move, end); });
  }

  void Stop() {
    ++tally_.stopped;
    rig_->Stop({}, [](Result<void>) {});
  }

  void Judge(Move& move, const Result<rig::MoveOutcome>& end) {
    move.ended = true;
    if (!end) {
      const bool asked_for = end.error().code == Code::Superseded || end.error().code == Code::Cancelled;
      if (!asked_for) Fail(end.error().message);
      return;
    }
    if (end->cause == rig::MoveCause::External) ++tally_.false_external;
    if (!end->reached) return Fail(end->reason);
    ++tally_.reached;
    const double shaft = device_.Shaft(clock_.Now());
    if (std::abs(shaft - move.target) > 1.0 + 1e-6) {
      ++tally_.false_reached;
      Show("false reached, at " + std::to_string(shaft) + " for " + std::to_string(move.target));
    }
    if (arrived_at_ && device_.kind().truthful()) {
      const Instant arrived = std::max(*arrived_at_, begun_at_);
      tally_.late_ms.push_back(std::chrono::duration<double, std::milli>(clock_.Now() - arrived).count());
    }
  }

  void Fail(const std::string& reason) {
    ++tally_.failed;
    std::string kind = reason;
    for (char& letter : kind) letter = letter >= '0' && letter <= '9' ? '#' : letter;
    if (tally_.reasons[kind]++ < 5) Show("failed: " + reason);
  }

  void Show(const std::string& what) const {
    const DeviceKind& kind = device_.kind();
    std::cout << what << "; speed " << kind.speed << ", range " << kind.range << ", echo " << kind.echo << " ms, stale "
              << kind.stale << " ms" << (kind.stale_first ? " first" : "") << (kind.varies ? ", varying" : "")
              << ", lie " << static_cast<int>(kind.lie) << (kind.lies_once ? " once" : "") << " from "
              << kind.lie_begins << " ms for " << kind.lie_lasts << " ms, busy " << static_cast<int>(kind.busy)
              << " by " << kind.busy_off << " ms, to " << target_ << " from " << from_ << ", shaft at "
              << device_.Shaft(clock_.Now()) << " after "
              << std::chrono::duration<double>(clock_.Now() - begun_at_).count() << " s\n";
  }

  void Step() {
    const Instant next = rig_->Step(clock_.Now());
    clock_.AdvanceTo(
        std::min(std::max(next, clock_.Now() + std::chrono::microseconds(100)), clock_.Now() + milliseconds(50)));
    if (device_.Turns(clock_.Now())) {
      arrived_at_.reset();
    } else if (!arrived_at_) {
      arrived_at_ = clock_.Now();
    }
    const auto focus = rig_->GetStatus().axes[Axis::Focus];
    if (focus && focus->moved_by_another && !std::exchange(said_external_, true)) {
      ++tally_.false_external;
      Show("the status says that another program moved it");
    }
    if (focus && !focus->moved_by_another) said_external_ = false;
  }
  void Idle(double ms) {
    const Instant end = clock_.Now() + std::chrono::microseconds(std::lround(1e3 * ms));
    while (clock_.Now() < end) Step();
  }
  void Await() {
    const Instant limit = clock_.Now() + std::chrono::minutes(5);
    while (!move_->ended && clock_.Now() < limit) Step();
    if (move_->ended) return;
    ++tally_.hung;
    Show("never ended");
    move_->ended = true;
  }

  Draw draw_;
  SteppedClock clock_;
  RegisterDevice device_;
  MoveTally& tally_;
  std::unique_ptr<rig::Rig> rig_;
  std::shared_ptr<Move> move_;
  double target_ = 0.0, from_ = 0.0;
  Instant begun_at_{};
  std::optional<Instant> arrived_at_;
  bool said_external_ = false;
};

}  // namespace

MoveTally RunDrawnMoves(const MakeLens& make, long moves, unsigned seed) {
  MoveTally tally;
  for (unsigned number = 0; tally.moves < moves; ++number) {
    std::seed_seq seeds{seed, number};
    std::mt19937_64 random(seeds);
    Moves device(make, Draw(random).Any(), random, tally);
    for (long i = 0; i < kEach && tally.moves < moves; ++i) device.Any();
  }
  return tally;
}

MoveTally RunTruthfulMoves(const MakeLens& make, long moves, unsigned seed) {
  MoveTally tally;
  for (unsigned number = 0; tally.moves < moves; ++number) {
    std::seed_seq seeds{seed, number};
    std::mt19937_64 random(seeds);
    Moves device(make, Draw(random).Truthful(), random, tally);
    for (long i = 0; i < kEach && tally.moves < moves; ++i) device.Ordinary();
  }
  return tally;
}

void Print(const char* what, MoveTally& tally) {
  std::cout << what << ": " << tally.moves << " moves, " << tally.stopped << " stopped, " << tally.retargeted
            << " sent elsewhere midway: " << tally.reached << " reached, " << tally.false_reached << " falsely, "
            << tally.false_external << " falsely external, " << tally.failed << " failed, " << tally.hung << " hung\n";
  for (const auto& [reason, count] : tally.reasons) std::cout << "  " << count << " x " << reason << "\n";
  if (tally.late_ms.empty()) return;
  std::ranges::sort(tally.late_ms);
  const auto part = [&](double fraction) {
    return tally.late_ms[static_cast<std::size_t>(fraction * static_cast<double>(tally.late_ms.size() - 1))];
  };
  double sum = 0.0;
  for (const double late : tally.late_ms) sum += late;
  std::cout << "  of true devices the end was said after the true one by: median " << part(0.5) << " ms, 90 % "
            << part(0.9) << " ms, 99 % " << part(0.99) << " ms, mean "
            << sum / static_cast<double>(tally.late_ms.size()) << " ms\n";
}

}  // namespace lensd::testing
