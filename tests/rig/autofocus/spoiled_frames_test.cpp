// The lens' own camera sends one bad frame, or is one frame late for ever, before simulated scenes at random distances:
// no answer is false, and nearly every search that one bad frame hits ends where the subject is.
#include <map>
#include <random>
#include <sstream>

#include "rig_on_sim.h"
#include "test_level.h"
#include "tests/rig/rig_fixture.h"

namespace lensd::rig {
namespace {

using namespace std::chrono_literals;
using Samples = std::vector<std::uint16_t>;

constexpr double kFocalLength = 0.025, kWideOpen = 2.0, kPitch = 3.45e-6;

enum class Spoiled { No, Black, White, CutOff, Torn, Stale, Late };
constexpr Spoiled kSpoiled[] = {Spoiled::Black, Spoiled::White, Spoiled::CutOff, Spoiled::Torn, Spoiled::Stale};
constexpr const char* kSpoiledNames[] = {"healthy", "black", "white", "cut off", "torn", "stale", "late"};

/// Spoils the frame that is asked for when as many have been used as a search tells.
class SpoilingCamera final : public drivers::Camera {
 public:
  struct Orders {
    Spoiled kind = Spoiled::No;
    int bad = 0;   ///< number of the frame, from 1
    int used = 0;  ///< frames of the search so far
    double cut = 0.5;
    bool done = false;
  };
  SpoilingCamera(std::unique_ptr<drivers::Camera> inner, std::shared_ptr<Orders> orders)
      : Camera(inner->capabilities()), inner_(std::move(inner)), orders_(std::move(orders)) {}

 private:
  Result<void> DoStart() override { return inner_->Start(); }
  Result<void> DoStop() override { return inner_->Stop(); }
  Result<std::optional<drivers::Frame>> DoPoll() override {
    auto frame = inner_->Poll();
    if (!frame || !*frame) return frame;
    const auto right = (*frame)->samples;
    if (orders_->kind == Spoiled::Late && before_) {
      (*frame)->samples = before_;
    } else if (orders_->used + 1 == orders_->bad && !std::exchange(orders_->done, true)) {
      (*frame)->samples = SpoiledOf(**frame);
    }
    before_ = right;
    return frame;
  }

  std::shared_ptr<const Samples> SpoiledOf(const drivers::Frame& frame) const {
    auto samples = std::make_shared<Samples>(*frame.samples);
    const auto full = static_cast<std::uint16_t>((1u << frame.bits) - 1u);
    const auto row = static_cast<std::ptrdiff_t>(orders_->cut * frame.height) * frame.width;
    if (orders_->kind == Spoiled::Black) std::ranges::fill(*samples, std::uint16_t{0});
    if (orders_->kind == Spoiled::White) std::ranges::fill(*samples, full);
    if (orders_->kind == Spoiled::CutOff) std::fill(samples->begin() + row, samples->end(), std::uint16_t{0});
    if (orders_->kind == Spoiled::Torn && before_)
      std::copy(before_->begin() + row, before_->end(), samples->begin() + row);
    if (orders_->kind == Spoiled::Stale && before_) return before_;
    return samples;
  }

  const std::unique_ptr<drivers::Camera> inner_;
  const std::shared_ptr<Orders> orders_;
  std::shared_ptr<const Samples> before_;
};

/// Its subject is anywhere from 0.5 m to infinity.
struct Place {
  std::string scene;
  double vergence = 0.0;
  double start = 0.0;
  std::uint64_t seed = 0;
};

std::string CameraAndLens(int bits) {
  return "version = 1\n[camera]\nwidth = 160\nheight = 120\npixel_um = 3.45\nexposure_ms = 4\nframe_rate_hz = 60\nbits "
         "= " +
         std::to_string(bits) +
         "\nblack_level = 0.02\nfull_well_e = 10000\nread_noise_e = 3.0\n[lens]\nfocal_length_mm = 25.0\nf_number = "
         "[1.4, 16.0]\nextension_mm = [-0.2, 1.6]\nsteps = 8192\nspeed_steps_per_s = 8000\nsettle_ms = 5\n"
         "initial_f_number = 2.0\n[truth]\nregion = [0.3, 0.3, 0.4, 0.4]\n";
}

Place DrawTexture(std::mt19937_64& random) {
  constexpr const char* kTextures[] = {"textures/gravel", "textures/brick", "score/leaves", "score/plaster"};
  Place place;
  place.vergence = std::uniform_real_distribution(0.2, 1.9)(random);
  std::ostringstream text;
  text << CameraAndLens(8) << "[[surface]]\nkind = \"wall\"\ndistance_m = " << 1.0 / place.vergence << "\ntexture = \""
       << LENSD_SOURCE_DIR << "/scenes/" << kTextures[random() % std::size(kTextures)] << ".png\"\n";
  place.scene = text.str();
  return place;
}

Place DrawStars(std::mt19937_64& random) {
  std::uniform_real_distribution along(0.32, 0.68), brightness(5.0, 40.0);
  std::ostringstream text;
  text << CameraAndLens(12);
  for (int i = 0; i < 6; ++i) {
    text << "[[light]]\nx = " << along(random) << "\ny = " << along(random)
         << "\ndistance_m = inf\nintensity = " << brightness(random) << "\n";
  }
  return {.scene = text.str(), .vergence = 0.0, .start = 0.0, .seed = 0};
}

struct Outcome {
  enum class How { Within, Off, False, Refused } how = How::Refused;
  AutofocusOutcome answer;
};

Outcome Play(const Place& place, const std::string& method, SpoilingCamera::Orders orders) {
  SteppedClock clock;
  auto world = sim::OpenWorld(testing::SceneFromText(place.scene), clock,
                              {.seed = place.seed, .focus_start = Native{place.start}});
  EXPECT_TRUE(world) << world.error().message;
  const auto shared = std::make_shared<SpoilingCamera::Orders>(orders);
  world->device.camera = std::make_unique<SpoilingCamera>(std::move(world->device.camera), shared);
  auto rig = *Rig::Create({}, std::move(world->device), clock);
  Answers<AutofocusOutcome> answers;
  rig->Autofocus({.method = method}, [&](const AutofocusProgress& now) { shared->used = now.frames; }, answers.Take());
  while (answers.all.empty() && clock.Now() < Instant{1000s})
    clock.AdvanceTo(std::max(rig->Step(clock.Now()), clock.Now() + 100us));
  Outcome outcome;
  EXPECT_TRUE(answers.only()) << answers.only().error().message;
  if (!answers.only()) return outcome;
  outcome.answer = *answers.only();
  if (!outcome.answer.focused) return outcome;
  const double half_d = 2 * kPitch * kWideOpen / (kFocalLength * 0.0257);
  const double off = std::abs(outcome.answer.vergence->value - place.vergence);
  outcome.how = off <= half_d ? Outcome::How::Within : off > 2 * half_d ? Outcome::How::False : Outcome::How::Off;
  return outcome;
}

struct Drawn {
  Place place;
  std::string method;
};
Drawn Draw(std::mt19937_64& random) {
  constexpr const char* kTexture[] = {"auto", "auto", "sweep", "moving", "contrast-scan"};
  const bool stars = random() % 5 == 0;
  Drawn drawn{stars ? DrawStars(random) : DrawTexture(random),
              stars ? "stars" : kTexture[random() % std::size(kTexture)]};
  drawn.place.start = std::floor(std::uniform_real_distribution(0.0, 8191.0)(random));
  drawn.place.seed = random();
  return drawn;
}

std::string Describe(const Drawn& drawn, const SpoilingCamera::Orders& orders, const Outcome& outcome) {
  std::ostringstream text;
  text << drawn.method << " at " << drawn.place.vergence << " D from " << drawn.place.start << " seed "
       << drawn.place.seed << ", " << kSpoiledNames[static_cast<int>(orders.kind)] << " frame " << orders.bad
       << ": ended at " << (outcome.answer.vergence ? outcome.answer.vergence->value : -1.0) << " after "
       << outcome.answer.frames << " frames: " << outcome.answer.reason;
  return text.str();
}

TEST(SpoiledFrames, OneIsTakenAgain) {
  std::mt19937_64 random(383);
  const long runs = testing::ByLevel(3, 10, 1000);
  std::map<Spoiled, std::map<Outcome::How, int>> counts;
  int all = 0, within = 0;
  for (long i = 0; i < runs; ++i) {
    const Drawn drawn = Draw(random);
    const Outcome healthy = Play(drawn.place, drawn.method, {});
    EXPECT_TRUE(healthy.answer.left_out.empty())
        << "a healthy camera is asked for no frame more: " << Describe(drawn, {}, healthy);
    if (healthy.how != Outcome::How::Within) continue;
    SpoilingCamera::Orders orders{.kind = kSpoiled[random() % std::size(kSpoiled)]};
    const bool needs_before = orders.kind == Spoiled::Torn || orders.kind == Spoiled::Stale;
    const int first = needs_before ? 2 : 1;
    orders.bad =
        first + static_cast<int>(random() % static_cast<unsigned>(std::max(1, healthy.answer.frames - first + 1)));
    orders.cut = std::uniform_real_distribution(0.42, 0.58)(random);
    const Outcome spoiled = Play(drawn.place, drawn.method, orders);
    EXPECT_NE(spoiled.how, Outcome::How::False) << Describe(drawn, orders, spoiled);
    if (spoiled.how != Outcome::How::Within && std::getenv("TELL") != nullptr) {
      std::printf("%s\n", Describe(drawn, orders, spoiled).c_str());
    }
    ++counts[orders.kind][spoiled.how];
    ++all;
    within += spoiled.how == Outcome::How::Within ? 1 : 0;
  }
  for (auto& [kind, ends] : counts) {
    std::printf("%-8s %d within, %d off, %d refused, %d false\n", kSpoiledNames[static_cast<int>(kind)],
                ends[Outcome::How::Within], ends[Outcome::How::Off], ends[Outcome::How::Refused],
                ends[Outcome::How::False]);
  }
  EXPECT_GE(within, 0.95 * all) << all;
}

TEST(SpoiledFrames, ALateCameraIsNeverBelieved) {
  std::mt19937_64 random(384);
  const long runs = testing::ByLevel(3, 10, 500);
  std::map<Outcome::How, int> ends;
  for (long i = 0; i < runs; ++i) {
    const Drawn drawn = Draw(random);
    const SpoilingCamera::Orders orders{.kind = Spoiled::Late};
    const Outcome late = Play(drawn.place, drawn.method, orders);
    EXPECT_NE(late.how, Outcome::How::False) << Describe(drawn, orders, late);
    if (late.how != Outcome::How::Within && std::getenv("TELL") != nullptr) {
      std::printf("%s\n", Describe(drawn, orders, late).c_str());
    }
    ++ends[late.how];
  }
  std::printf("late: %d within, %d off, %d refused, %d false\n", ends[Outcome::How::Within], ends[Outcome::How::Off],
              ends[Outcome::How::Refused], ends[Outcome::How::False]);
}

}  // namespace
}  // namespace lensd::rig
