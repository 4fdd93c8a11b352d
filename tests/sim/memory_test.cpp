// What a simulated lens remembers takes the memory that it says, and no more however long it runs.
#include <gtest/gtest.h>
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <memory>
#include <memory_resource>
#include <random>
#include <string>
#include <vector>

#include "sim/camera/small_blocks.h"
#include "sim/mechanics/motor.h"
#include "sim/pictures.h"
#include "stage.h"
#include "test_level.h"

namespace lensd::sim {
namespace {

/// In use of the heap.
std::size_t LiveBytes() {
  return mallinfo2().uordblks;
}

/// Sanitizers have allocators of their own, of which mallinfo2() knows nothing.
bool LiveBytesAreCounted() {
  const std::size_t before = LiveBytes();
  const std::vector<char> trial(std::size_t{64} << 10);
  return LiveBytes() >= before + trial.size();
}

/// What the process has of memory that is no file's.
std::size_t ResidentBytes() {
  std::ifstream maps("/proc/self/smaps_rollup");
  for (std::string line; std::getline(maps, line);) {
    if (line.starts_with("Anonymous:")) return std::stoul(line.substr(10)) * 1024;
  }
  return 0;
}

Duration FromSeconds(double seconds) {
  return Duration(std::llround(seconds * 1e9));
}

/// A motor and commands and faults at random.
class DrawnMotor {
 public:
  explicit DrawnMotor(unsigned seed) : random_(seed), motor_(Settings(), 3000.0) {}

  const Motor& motor() const { return motor_; }
  /// Of the last command, and the next.
  Duration last() const { return last_; }
  Duration next() const { return next_; }

  void Command() {
    last_ = next_;
    next_ += FromSeconds(Uniform(0.001, 0.4));
    const double kind = Uniform(0.0, 1.0);
    if (kind < 0.55) return motor_.MoveTo(last_, std::round(Uniform(0.0, 8191.0)));
    if (kind < 0.75) return motor_.Halt(last_, 1.0);
    if (kind < 0.80) return motor_.Home(last_);
    if (kind < 0.85) return motor_.SetLoss(last_, Uniform(0.0, 1.0) < 0.5 ? 0.0 : Uniform(0.0, 1.0));
    if (kind < 0.90) return motor_.Knock(last_, Uniform(-200.0, 200.0));
    if (kind < 0.95) return motor_.LosePower(last_);
    motor_.SetStalled(last_, Uniform(0.0, 1.0) < 0.5);
  }
  double Uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

 private:
  MotorSettings Settings() {
    MotorSettings settings;
    settings.high = 8191.0;
    settings.top_speed = Uniform(1000.0, 20000.0);
    settings.acceleration = Uniform(20000.0, 400000.0);
    settings.backlash = Uniform(0.0, 1.0) < 0.3 ? 0.0 : Uniform(0.0, 60.0);
    settings.creep_s = Uniform(0.0, 0.01);
    settings.ring_hz = Uniform(0.0, 1.0) < 0.5 ? 0.0 : Uniform(10.0, 80.0);
    return settings;
  }

  std::mt19937 random_;
  Motor motor_;
  Duration last_{}, next_ = FromSeconds(0.1);
};

/// All that a motor says of one instant.
struct Seen {
  Duration at;
  double count, place, rest;
  bool moving, homed, complains;
  bool operator==(const Seen&) const = default;
};
Seen Look(const Motor& motor, Duration at) {
  return {at,
          motor.CountAt(at),
          motor.PlaceAt(at),
          motor.RestPlaceAt(at),
          motor.MovingAt(at),
          motor.HomedAt(at),
          motor.ComplainsAt(at)};
}

TEST(Memory, AMotorsPastStaysAsItWas) {
  constexpr int kCommands = 700;
  constexpr int kRemembered = 400;  // at least
  const long motors = testing::ByLevel(5, 20, 1000);
  long asked = 0;
  for (long seed = 0; seed < motors; ++seed) {
    DrawnMotor drawn(static_cast<unsigned>(seed));
    std::vector<Seen> seen;  // while the command was the newest
    for (int i = 0; i < kCommands; ++i) {
      drawn.Command();
      const auto until_next = static_cast<double>((drawn.next() - drawn.last()).count() - 1);
      for (int k = 0; k < 3; ++k) {
        seen.push_back(Look(drawn.motor(), drawn.last() + Duration(std::llround(drawn.Uniform(0.0, until_next)))));
      }
    }
    EXPECT_LE(drawn.motor().earliest(), seen[3 * (kCommands - kRemembered)].at) << "seed " << seed;
    std::ranges::shuffle(seen, std::mt19937(static_cast<unsigned>(seed)));
    for (const Seen& one : seen) {
      if (one.at < drawn.motor().earliest()) continue;
      ++asked;
      ASSERT_EQ(Look(drawn.motor(), one.at), one) << "seed " << seed << " at " << one.at.count();
    }
  }
  std::printf("%ld instants of the past of %ld motors\n", asked, motors);
}

TEST(Memory, AMotorTakesWhatItTookAtFirst) {
  if (!LiveBytesAreCounted()) GTEST_SKIP() << "another allocator";
  for (unsigned seed = 0; seed < 10; ++seed) {
    DrawnMotor drawn(seed);
    for (int i = 0; i < 20; ++i) drawn.Command();
    const std::size_t before = LiveBytes();
    for (int i = 0; i < 1000; ++i) drawn.Command();
    EXPECT_LT(LiveBytes(), before + 4096) << "seed " << seed;
  }
}

TEST(Memory, PicturesTakeWhatTheySay) {
  if (!LiveBytesAreCounted()) GTEST_SKIP() << "another allocator";
  std::mt19937 random(11);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  constexpr std::size_t kBudget = std::size_t{8} << 20;
  double worst = 0.0;
  for (int round = 0; round < 6; ++round) {
    Scene scene = SmallScene();
    // The first is that of tests/daemon: ten of its pictures are whole pages.
    scene.camera.width = round == 0 ? 64 : static_cast<int>(uniform(16.0, 50.0));
    scene.camera.height = round == 0 ? 48 : static_cast<int>(uniform(16.0, 40.0));
    scene.surfaces[0].paint = SinusoidPaint{8.0, 0.0};
    if (round % 2 == 1) scene.lights.push_back({0.5, 0.5, 1.0, uniform(3.0, 300.0)});  // brighter than white
    const auto pictures = *Pictures::Create(std::make_shared<const Scene>(scene), kBudget);
    std::vector<std::vector<char>> passing(64);
    const auto take = [&] {
      ASSERT_TRUE(pictures->At({LensModel::Thin, 0.025, 0.025 / uniform(1.4, 8.0), 0.025 + uniform(0.0, 1e-3)}));
      // What a program does meanwhile.
      passing[random() % passing.size()] = std::vector<char>(static_cast<std::size_t>(uniform(1.0, 4096.0)), 'x');
    };
    for (int i = 0; i < 400; ++i) take();  // what is made once is made now
    const std::size_t resident = ResidentBytes();
    const std::size_t said = pictures->bytes();
    const std::size_t live = LiveBytes();
    for (int i = 0; i < 1200; ++i) take();
    const auto taken = static_cast<double>(ResidentBytes()) - static_cast<double>(resident);
    const auto told = static_cast<double>(pictures->bytes()) - static_cast<double>(said);
    worst = std::max(worst, std::abs(taken - told));
    EXPECT_LE(pictures->bytes(), kBudget);
    EXPECT_LE(taken, 1.02 * told + 128e3) << "round " << round;
    EXPECT_GE(taken, 0.98 * told - 128e3) << "round " << round;
    // Of what is remembered nothing lies among what passes: `passing` and a few lists of pages are all that the common
    // heap has.
    EXPECT_LE(LiveBytes(), live + (std::size_t{160} << 10)) << "round " << round;
  }
  std::printf("memory of pictures differs from what is said by at most %.0f KiB\n", worst / 1024.0);
}

/// Pages whose number is known.
class CountedPages final : public std::pmr::memory_resource {
 public:
  std::size_t count() const { return count_; }

 private:
  void* do_allocate(std::size_t bytes, std::size_t) override {
    ++count_;
    return std::pmr::new_delete_resource()->allocate(bytes, bytes);
  }
  void do_deallocate(void* page, std::size_t bytes, std::size_t) override {
    --count_;
    std::pmr::new_delete_resource()->deallocate(page, bytes, bytes);
  }
  bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }

  std::size_t count_ = 0;
};

/// Blocks of random sizes are taken and given back in random order: none overlaps another, which their bytes show, and
/// pages without a block go back.
TEST(Memory, SmallBlocksKeepTheirBytesAndGiveBackTheirPages) {
  struct Block {
    unsigned char* at;
    std::size_t bytes;
    unsigned char mark;
  };
  const auto page_bytes = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  const long seeds = testing::ByLevel(20, 100, 5000);
  for (long seed = 0; seed < seeds; ++seed) {
    std::mt19937 random(static_cast<unsigned>(seed));
    const auto below = [&](std::size_t limit) { return static_cast<std::size_t>(random()) % limit; };
    CountedPages pages;
    SmallBlocks small(pages);
    std::vector<Block> blocks;
    const auto give_back_any = [&] {
      std::swap(blocks[below(blocks.size())], blocks.back());
      const Block block = blocks.back();
      blocks.pop_back();
      ASSERT_EQ(std::count(block.at, block.at + block.bytes, block.mark), static_cast<std::ptrdiff_t>(block.bytes))
          << "seed " << seed;
      small.GiveBack(block.at);
    };
    const std::size_t largest = 1 + below(SmallBlocks::kLargest);
    for (const std::size_t goal : {below(500), below(50), below(500)}) {
      for (int i = 0; i < 500; ++i) {
        // About as many as the goal.
        if (blocks.empty() || below(goal + 1) + goal / 2 >= blocks.size()) {
          const std::size_t bytes = 1 + below(largest);
          auto* const at = static_cast<unsigned char*>(small.Take(bytes));
          ASSERT_EQ(reinterpret_cast<std::uintptr_t>(at) % alignof(std::max_align_t), 0u) << "seed " << seed;
          blocks.push_back({at, bytes, static_cast<unsigned char>(random())});
          std::fill_n(at, bytes, blocks.back().mark);
        } else {
          give_back_any();
        }
      }
    }
    ASSERT_LE(pages.count(), blocks.size()) << "seed " << seed;
    while (!blocks.empty()) give_back_any();
    ASSERT_EQ(pages.count(), 0u) << "seed " << seed;

    // Of one size the blocks fill their pages.
    const std::size_t bytes = 1 + below(SmallBlocks::kLargest);
    std::vector<void*> alike;
    for (int i = 0; i < 1000; ++i) alike.push_back(small.Take(bytes));
    ASSERT_LE((pages.count() - 1) * page_bytes, alike.size() * SmallBlocks::BytesFor(bytes)) << "seed " << seed;
    ASSERT_LE(SmallBlocks::BytesFor(bytes), bytes * 5 / 4 + 16) << "seed " << seed;
    for (void* const block : alike) small.GiveBack(block);
    ASSERT_EQ(pages.count(), 0u) << "seed " << seed;
  }
}

TEST(Memory, PicturesStayWithinTheirBudget) {
  for (const int width : {24, 64, 150, 400, 900}) {
    Scene scene = SmallScene();
    scene.camera.width = width;
    scene.camera.height = width / 2;
    scene.lights.push_back({0.5, 0.5, 1.0, 300.0});
    constexpr std::size_t kBudget = std::size_t{3} << 19;
    const auto pictures = *Pictures::Create(std::make_shared<const Scene>(scene), kBudget);
    std::size_t most = 0;
    for (int i = 0; i < std::min(2000, 600 * 24 / width); ++i) {
      ASSERT_TRUE(pictures->At({LensModel::Thin, 0.025, 0.0125, 0.025 + 1e-6 * i}));
      most = std::max(most, pictures->bytes());
    }
    EXPECT_LE(most, kBudget) << width;
  }
}

}  // namespace
}  // namespace lensd::sim
