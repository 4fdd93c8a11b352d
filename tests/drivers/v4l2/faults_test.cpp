// Thousands of moves of a lens behind a kernel driver while writes are refused, lost, late or changed, reads fail or
// are stale, others move it, it loses its power or is unplugged: the rig on top, on the stepped clock. What is called
// reached is there.
#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <random>

#include "open.h"
#include "open_files.h"
#include "rig/rig.h"
#include "scripted_kernel.h"
#include "test_level.h"

namespace lensd::drivers::v4l2 {
namespace {

using namespace std::chrono_literals;

constexpr const char* kNode = "/dev/v4l-subdev0";
constexpr std::int64_t kTop = 1023;
constexpr Duration kLag = 15ms;  ///< that the mechanism needs once a code is in force

/// What the control tells when it is read.
enum class Kind {
  Register,   ///< the code in force
  Place,      ///< where the mechanism is
  WriteOnly,  ///< nothing
};

/// A coil behind its driver: a code comes into force, at once or later, and the mechanism follows.
class Coil {
 public:
  void Order(std::int64_t code, Instant due) { coming_ = {code, due}; }
  void Force(std::int64_t code, Instant now) {
    from_ = Place(now);
    since_ = now;
    code_ = code;
    coming_.reset();
  }
  void Step(Instant now) {
    if (coming_ && now >= coming_->second) Force(coming_->first, now);
  }
  std::int64_t code() const { return code_; }
  double Place(Instant now) const {
    const double part = std::chrono::duration<double>(now - since_) / std::chrono::duration<double>(kLag);
    return from_ + std::clamp(part, 0.0, 1.0) * (static_cast<double>(code_) - from_);
  }

 private:
  std::int64_t code_ = 0;
  double from_ = 0.0;
  Instant since_{};
  std::optional<std::pair<std::int64_t, Instant>> coming_;
};

struct Tally {
  long moves = 0, reached = 0, not_reached = 0, failed = 0, verified = 0, lies = 0, faults = 0;
};

class Storm {
 public:
  Storm(Kind kind, unsigned seed) : kind_(kind), random_(seed) {
    ScriptedControl control{.name = "Focus, Absolute", .maximum = kTop};
    if (kind == Kind::WriteOnly) control.flags = V4L2_CTRL_FLAG_WRITE_ONLY;
    if (kind == Kind::Place) control.flags = V4L2_CTRL_FLAG_VOLATILE;
    control.applied = [this](std::int64_t asked) { return Take(asked); };
    kernel_.nodes[kNode].controls[V4L2_CID_FOCUS_ABSOLUTE] = std::move(control);
    Open();
  }

  /// One move with whatever goes wrong meanwhile. False: it never ended.
  bool Once(Tally& tally) {
    const double target = std::floor(Uniform() * (kTop + 1));
    std::optional<Result<rig::MoveOutcome>> end;
    double where = -1.0;
    rig_->Move(Axis::Focus, {.kind = rig::Target::Kind::Native, .value = target, .from = {}},
               [&](Result<rig::MoveOutcome> outcome) {
                 where = coil_.Place(clock_.Now());  // then, not later
                 end = std::move(outcome);
               });
    const Instant limit = clock_.Now() + 60s;
    Instant next_fault = clock_.Now() + Random(50ms);
    while (!end && clock_.Now() < limit) {
      if (clock_.Now() >= next_fault) {
        GoWrong();
        ++tally.faults;
        next_fault = clock_.Now() + Random(400ms);
      }
      Show();
      const Instant next = rig_->Step(clock_.Now());
      clock_.AdvanceTo(std::min({std::max(next, clock_.Now() + 100us), next_fault, limit}));
    }
    if (!end) return false;
    Judge(*end, target, where, tally);
    CalmDown();
    return true;
  }

 private:
  double Uniform() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  Duration Random(Duration below) {
    return std::chrono::duration_cast<Duration>(Uniform() * std::chrono::duration<double>(below));
  }
  int Few() { return 1 + static_cast<int>(Uniform() * 4); }

  void Open() {
    Config config{.device = kNode};
    config.axes[Axis::Focus].settle = 20ms;
    if (Uniform() < 0.5) config.axes[Axis::Focus].speed = 4000;
    auto device = OpenOn(kernel_, config, clock_);
    ASSERT_TRUE(device) << device.error().message;
    rig::RigConfig moves;
    moves.axes[Axis::Focus].speed = 1e5;  // of the lens itself; nothing else tells how long its way takes
    auto rig = rig::Rig::Create(moves, *std::move(device), clock_);
    ASSERT_TRUE(rig) << rig.error().message;
    rig_ = *std::move(rig);
  }

  std::int64_t Said() const {
    if (clock_.Now() < stale_until_) return stale_;
    return kind_ == Kind::Place ? std::llround(coil_.Place(clock_.Now())) : coil_.code();
  }

  /// What the driver below the control makes of a value; the answer is what the control says from now on.
  std::int64_t Take(std::int64_t asked) {
    if (lost_ > 0) return --lost_, Said();
    if (changed_ > 0) {
      --changed_;
      asked = static_cast<std::int64_t>(Uniform() * (kTop + 1));
    }
    coil_.Order(asked, clock_.Now() + late_);
    coil_.Step(clock_.Now());
    return Said();
  }

  /// Brings what the kernel says up to this instant.
  void Show() {
    const Instant now = clock_.Now();
    coil_.Step(now);
    ScriptedNode& node = kernel_.nodes[kNode];
    node.controls[V4L2_CID_FOCUS_ABSOLUTE].value = Said();
    if (now >= refuses_until_) node.failing.clear();
  }

  /// Where the control tells nothing, only what the driver admits can be known.
  void GoWrong() {
    constexpr int kErrors[] = {EIO, EREMOTEIO, ETIMEDOUT, EBUSY, EPIPE, EPROTO, EILSEQ, ERANGE};
    const Instant now = clock_.Now();
    ScriptedNode& node = kernel_.nodes[kNode];
    const int kind = static_cast<int>(Uniform() * (kind_ == Kind::WriteOnly ? 3 : 9));
    const int error = kErrors[static_cast<std::size_t>(Uniform() * std::size(kErrors))];
    refuses_until_ = now + Random(400ms);
    if (kind == 0) node.failing[VIDIOC_S_EXT_CTRLS] = error;
    if (kind == 1) node.failing[kind_ == Kind::WriteOnly ? VIDIOC_QUERY_EXT_CTRL : VIDIOC_G_EXT_CTRLS] = error;
    if (kind == 2) node.gone = true;
    if (kind == 3) lost_ = Few();
    if (kind == 4) changed_ = Few();
    if (kind == 5) late_ = Random(400ms);
    if (kind == 6) stale_ = Said(), stale_until_ = now + Random(400ms);
    if (kind >= 7) stale_until_ = now;   // a control that goes on saying the place from before hides it from everybody
    if (kind == 7) coil_.Force(0, now);  // its power was gone for a moment
    if (kind == 8) coil_.Force(static_cast<std::int64_t>(Uniform() * kTop), now);  // another program
  }

  void Judge(const Result<rig::MoveOutcome>& end, double target, double where, Tally& tally) {
    ++tally.moves;
    if (!end) {
      ++tally.failed;
    } else if (!end->reached) {
      ++tally.not_reached;
      EXPECT_NE(end->reason, "");
    } else {
      ++tally.reached;
      if (end->verified) ++tally.verified;
      if (std::abs(where - target) <= 1.0) return;
      ++tally.lies;
      std::printf("falsely reached: target %g, truly %g, said %g\n", target, where, end->position.value);
    }
  }

  /// What vanished is opened anew, as the daemon does.
  void CalmDown() {
    ScriptedNode& node = kernel_.nodes[kNode];
    node.failing.clear();
    lost_ = changed_ = 0;
    late_ = {};
    if (!std::exchange(node.gone, false)) return;
    rig_.reset();
    Show();
    Open();
  }

  const Kind kind_;
  std::mt19937 random_;
  SteppedClock clock_;
  ScriptedKernel kernel_;
  Coil coil_;
  std::unique_ptr<rig::Rig> rig_;
  int lost_ = 0, changed_ = 0;
  Duration late_{};
  std::int64_t stale_ = 0;
  Instant stale_until_{}, refuses_until_{};
};

class V4l2Faults : public ::testing::TestWithParam<Kind> {};
std::string NameOf(const ::testing::TestParamInfo<Kind>& control) {
  constexpr const char* kNames[] = {"Register", "Place", "WriteOnly"};
  return kNames[static_cast<int>(control.param)];
}
INSTANTIATE_TEST_SUITE_P(Control, V4l2Faults, ::testing::Values(Kind::Register, Kind::Place, Kind::WriteOnly), NameOf);

TEST_P(V4l2Faults, NothingIsReachedThatIsNotThere) {
  const long moves = testing::ByLevel(100, 1000, 10'000);
  Storm storm(GetParam(), 31);
  const int open_files = testing::OpenFiles();
  Tally tally;
  for (long i = 0; i < moves; ++i) ASSERT_TRUE(storm.Once(tally)) << "move " << i << " never ended";
  std::printf("%ld moves, %ld faults: %ld reached, %ld not reached, %ld failed, %ld verified, %ld falsely reached\n",
              tally.moves, tally.faults, tally.reached, tally.not_reached, tally.failed, tally.verified, tally.lies);
  EXPECT_EQ(tally.lies, 0);
  // A place that is told is worth something only as long as the lens has not moved: steps may get lost.
  EXPECT_LE(tally.verified, GetParam() == Kind::Place ? moves / 100 : 0);
  EXPECT_GT(tally.reached, moves / 4) << "the storm leaves nothing to judge";
  EXPECT_GT(tally.not_reached + tally.failed, moves / 50) << "the storm is none";
  EXPECT_EQ(testing::OpenFiles(), open_files);
}

}  // namespace
}  // namespace lensd::drivers::v4l2
