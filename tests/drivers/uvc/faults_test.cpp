// Thousands of moves with everything going wrong at random, the rig on top, on the stepped clock.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "model_transport.h"
#include "open_files.h"
#include "resident_memory.h"
#include "rig/rig.h"
#include "test_level.h"

namespace lensd::drivers::uvc {
namespace {

using sim::devices::UvcModel;
using sim::devices::UvcOptions;

struct Tally {
  int reached = 0, not_reached = 0, failed = 0, lies = 0;
};

class Bench {
 public:
  Bench(const UvcOptions& options, Feedback feedback, unsigned seed) : random_(seed) {
    model_ = UvcModel::Create(SmallScene(), clock_, options).value();
    transport_ = std::make_shared<ModelTransport>(clock_, *model_);
    config_.lens_config.feedback = feedback;
    config_.camera = false;
  }

  void Open() {
    model_->faults() = {};
    auto device = OpenOnModel(transport_, *model_, clock_, config_);
    ASSERT_TRUE(device.has_value()) << device.error().message;
    rig::RigConfig config;
    // A lens that only echoes is believed after the time its whole travel takes; one that tells the end, at once.
    auto& focus = config.axes[Axis::Focus];
    focus.speed = 1e6;
    if (!Follows(config_.lens_config.feedback) && !model_->options().asynchronous)
      focus.settle = std::chrono::milliseconds(700);
    auto made = rig::Rig::Create(config, *std::move(device), clock_);
    ASSERT_TRUE(made.has_value()) << made.error().message;
    rig_ = *std::move(made);
  }
  void Close() { rig_.reset(); }

  void Move(Tally& tally) {
    Spoil();
    const double target = std::floor(Uniform() * 1024);
    std::optional<Result<rig::MoveOutcome>> end;
    double where = -1.0;
    rig_->Move(Axis::Focus, {.kind = rig::Target::Kind::Native, .value = target, .from = {}},
               [&](Result<rig::MoveOutcome> outcome) {
                 end = std::move(outcome);
                 where = model_->truth()->Now().focus_steps;  // then, not later
               });
    const Instant limit = clock_.Now() + std::chrono::minutes(5);
    while (!end && clock_.Now() < limit) {
      const Instant next = rig_->Step(clock_.Now());
      if (Uniform() < 0.01) SpoilStatus();
      clock_.AdvanceTo(std::min(std::max(next, clock_.Now() + std::chrono::microseconds(100)), limit));
    }
    ASSERT_TRUE(end) << "the move to " << target << " never ended";
    if (!*end) {
      ++tally.failed;
    } else if (!(*end)->reached) {
      ++tally.not_reached;
    } else {
      ++tally.reached;
      if (std::abs(where - target) > 1.0) ++tally.lies;
    }
  }

 private:
  double Uniform() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  int Count() { return 1 + static_cast<int>(Uniform() * 5); }

  void Spoil() {
    auto& faults = model_->faults();
    faults = {};
    constexpr std::uint8_t kErrors[] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 0xFF};
    const int which = static_cast<int>(Uniform() * 10);
    if (which == 0) faults.stall = Count();
    if (which == 1) faults.ignore = Count();
    if (which == 2) faults.lose = Count();
    if (which == 3) faults.late = Count();
    if (which == 4) faults.shorten = Count();
    if (which == 5) faults.stall = faults.lose = faults.ignore = 1;
    faults.error = kErrors[static_cast<std::size_t>(Uniform() * 10)];
    faults.delay = std::chrono::milliseconds(static_cast<int>(Uniform() * 2000));
    if (Uniform() < 0.02) model_->Reset();  // brown-out: the automatics are on again
  }
  void SpoilStatus() {
    if (Uniform() < 0.5) return transport_->LoseStatus();
    std::vector<std::uint8_t> stray(static_cast<std::size_t>(Uniform() * 9));
    for (auto& byte : stray) byte = static_cast<std::uint8_t>(Uniform() * 4);
    // Half of them look like the focus control's.
    constexpr std::uint8_t kFocusChange[] = {1, 1, 0, 6};
    if (Uniform() < 0.5) std::copy_n(kFocusChange, std::min<std::size_t>(4, stray.size()), stray.begin());
    transport_->QueueStatus(std::move(stray));
  }

  SteppedClock clock_;
  std::mt19937 random_;
  std::unique_ptr<UvcModel> model_;
  std::shared_ptr<ModelTransport> transport_;
  UvcConfig config_;
  std::unique_ptr<rig::Rig> rig_;
};

void MakeMoves(const UvcOptions& options, Feedback feedback, const char* name) {
  const long moves = testing::ByLevel(60, 350, 3500);
  Bench bench(options, feedback, 7);
  ASSERT_NO_FATAL_FAILURE(bench.Open());
  Tally tally;
  long open_files = 0, resident = 0;
  for (long i = 0; i < moves; ++i) {
    if (i == moves / 4) {
      open_files = testing::OpenFiles();
      resident = testing::ResidentKilobytes();
    }
    if (i % 50 == 49) {
      bench.Close();
      ASSERT_NO_FATAL_FAILURE(bench.Open());
    }
    ASSERT_NO_FATAL_FAILURE(bench.Move(tally));
  }
  std::printf("%s: %ld moves: %d reached, %d not reached, %d failed with an error\n", name, moves, tally.reached,
              tally.not_reached, tally.failed);
  EXPECT_EQ(tally.lies, 0) << "moves reported reached that were not";
  EXPECT_GT(tally.reached, moves / 3);
  EXPECT_GT(tally.not_reached + tally.failed, 0) << "no fault was ever noticed";
  EXPECT_EQ(testing::OpenFiles(), open_files);
  EXPECT_LT(testing::ResidentKilobytes() - resident, 4096);
}

TEST(UvcFaults, FeedbackNeverLies) {
  MakeMoves({}, Feedback::Encoder, "feedback");
}
TEST(UvcFaults, EchoNeverLies) {
  MakeMoves({.echo = true}, Feedback::Echo, "echo");
}
TEST(UvcFaults, AsynchronousNeverLies) {
  MakeMoves({.asynchronous = true, .echo = true}, Feedback::Echo, "asynchronous");
}

}  // namespace
}  // namespace lensd::drivers::uvc
