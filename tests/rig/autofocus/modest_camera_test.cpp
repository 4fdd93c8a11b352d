// Autofocus with small frames and with slow cameras, by default settings: the answer may be a refusal, for there is
// little to see, but never because of the size of the default region or because frames come slowly.
#include <chrono>
#include <random>
#include <sstream>

#include "rig_on_sim.h"
#include "test_level.h"
#include "tests/rig/rig_fixture.h"

namespace lensd::rig {
namespace {

using namespace std::chrono_literals;

constexpr double kFocalLength = 0.025, kFNumber = 2.0, kPitch = 3.45e-6;

struct Camera {
  int width;
  int height;
  double rate;
};

std::string SceneOf(const Camera& camera, double distance) {
  std::ostringstream text;
  text << "version = 1\n[camera]\nwidth = " << camera.width << "\nheight = " << camera.height
       << "\npixel_um = 3.45\nexposure_ms = 4\nframe_rate_hz = " << camera.rate
       << "\nfull_well_e = 10000\nread_noise_e = 3.0\n[lens]\nfocal_length_mm = 25.0\nf_number = [1.4, 16.0]\n"
          "extension_mm = [0.0, 1.6]\nsteps = 8192\nspeed_steps_per_s = 8000\nsettle_ms = 5\ninitial_f_number = 2.0\n"
          "[[surface]]\nkind = \"wall\"\ndistance_m = "
       << distance << "\ntexture = \"" << LENSD_SOURCE_DIR << "/scenes/textures/gravel.png\"\n";
  return text.str();
}

struct Score {
  int runs = 0;
  int focused = 0;
  std::string why_not;
};

Score Play(const Camera& camera, const std::string& method, int runs) {
  std::mt19937_64 random(static_cast<std::uint64_t>(camera.width * 1000 + camera.height));
  Score score;
  for (; score.runs < runs; ++score.runs) {
    const double distance = 1.0 / std::uniform_real_distribution(0.3, 2.0)(random);
    const double start = std::floor(std::uniform_real_distribution(0.0, 8191.0)(random));
    testing::RigOnSim bench(SceneOf(camera, distance), random(), start);
    Answers<AutofocusOutcome> answers;
    bench.rig->Autofocus({.method = method}, nullptr, answers.Take());
    bench.RunUntil([&] { return !answers.all.empty(); }, 1h);
    const auto& answer = answers.only();
    EXPECT_TRUE(answer) << answer.error().message;
    if (!answer) return score;
    if (!answer->focused) {
      score.why_not += "\n" + answer->reason;
      EXPECT_EQ(answer->reason.find("deadline"), std::string::npos) << answer->reason;
      continue;
    }
    ++score.focused;
    // Twice half a depth of field: beyond that it is false.
    const double half_d = 2 * kPitch * kFNumber / (kFocalLength * 0.0257);
    EXPECT_NEAR(answer->vergence->value, 1.0 / distance, 2 * half_d) << answer->reason;
  }
  return score;
}

TEST(ModestCamera, AFrameOf98x50IsNoReasonToRefuse) {
  for (const char* method : {"auto", "sweep"}) {
    const int runs = static_cast<int>(testing::ByLevel(5, 20, 200));
    const Score score = Play({98, 50, 60}, method, runs);
    std::printf("98 x 50 px, %s: %d of %d focused\n", method, score.focused, score.runs);
    EXPECT_GE(score.focused, score.runs * 8 / 10) << score.why_not;
  }
}

TEST(ModestCamera, FiveFramesASecondAndFewerAreNoReasonToRefuse) {
  for (const double rate : {5.0, 0.5, 0.1}) {
    for (const char* method : {"auto", "sweep"}) {
      const int runs = static_cast<int>(testing::ByLevel(2, 5, 100));
      const Score score = Play({160, 120, rate}, method, runs);
      std::printf("%g frames a second, %s: %d of %d focused\n", rate, method, score.focused, score.runs);
      EXPECT_GE(score.focused, score.runs * 8 / 10) << score.why_not;
    }
  }
}

}  // namespace
}  // namespace lensd::rig
