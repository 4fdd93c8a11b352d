// Plans applied to simulated lenses and judged from the simulator's truth: what `reached` calls feasible is, and what
// is possible with room to spare is called so. The judge computes blur from rays' geometry alone: A |Z_s (1/f - U) -
// 1|.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>

#include "planning/planning.h"
#include "sim/world.h"
#include "test_level.h"

namespace lensd::daemon {
namespace {

using drivers::Axis;

enum class Kind { Fixed, Zoom, Breathing, Drift, FocusBacklash, IrisBacklash, Several };
constexpr Kind kKinds[] = {Kind::Fixed,         Kind::Zoom,         Kind::Breathing, Kind::Drift,
                           Kind::FocusBacklash, Kind::IrisBacklash, Kind::Several};
constexpr int kPlansALens = 10;
constexpr double kPossible = 1.2;  // what has so much room is to be called feasible
constexpr double kFalse = 1.02;    // and what breaks a limit by more is false

struct Lens {
  std::shared_ptr<sim::Scene> scene;
  rig::RigConfig config;
  std::shared_ptr<rig::Calibration> calibration;
};

class Judge {
 public:
  explicit Judge(Kind kind, std::uint64_t seed) : kind_(kind), random_(seed) {}

  int plans = 0, reached = 0, wrong = 0, beyond_bound = 0, possible = 0, found = 0, other_than_status = 0;

  void JudgeLens() {
    const Lens lens = RandomLens();
    SteppedClock clock;
    auto world = sim::OpenWorld(lens.scene, clock);
    ASSERT_TRUE(world.has_value()) << world.error().message;
    const auto truth = world->truth;
    auto rig = rig::Rig::Create(lens.config, std::move(world->device), clock, lens.calibration);
    ASSERT_TRUE(rig.has_value()) << rig.error().message;
    for (int i = 0; i < kPlansALens; ++i) JudgePlan(lens, **rig, clock, *truth);
  }

 private:
  double Uniform(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
  double Log(double low, double high) { return std::exp(Uniform(std::log(low), std::log(high))); }
  bool Is(Kind kind) { return kind_ == kind || (kind_ == Kind::Several && Uniform(0, 1) < 0.6); }

  /// A lens with its faults, and a calibration and coefficients that tell of them.
  Lens RandomLens() {
    Lens lens{std::make_shared<sim::Scene>(), {}, std::make_shared<rig::Calibration>()};
    lens.scene->camera.width = lens.scene->camera.height = 8;
    lens.scene->surfaces.push_back({.shape = sim::PlaneShape{}, .region = {}, .paint = sim::ConstantPaint{}});
    sim::LensSettings& made = lens.scene->lens;
    made.min_focal_length_mm = made.max_focal_length_mm = Log(8.0, 85.0);
    made.min_f_number = made.initial_f_number = Uniform(1.2, 4.0);
    made.max_f_number = made.min_f_number * Uniform(4.0, 12.0);
    made.max_extension_mm = made.min_focal_length_mm * Uniform(0.02, 0.12);
    made.min_extension_mm = Uniform(0, 1) < 0.3 ? -0.03 * made.max_extension_mm : 0.0;
    made.steps = static_cast<int>(Log(800, 5000));
    made.speed_steps_per_s = 20000.0;
    made.settle_ms = 5.0;
    made.iris_steps = static_cast<int>(Log(40, 200));
    auto& focus = lens.config.axes[Axis::Focus];
    if (Is(Kind::Zoom)) made.max_focal_length_mm *= Uniform(1.3, 3.0);
    if (made.zooms()) made.centre_shift_mm = Uniform(-0.5, 0.5) * made.max_focal_length_mm;
    if (Is(Kind::Breathing)) made.breathing = Uniform(-0.05, 0.1);
    if (Is(Kind::Drift)) {
      made.temperature_c = Uniform(0.0, 40.0);
      made.drift_um_per_c = Uniform(-3.0, 3.0);
      lens.config.temperature.compensate = true;
      rig::TemperatureModel model;
      model.per_degree = Metres{made.drift_um_per_c * 1e-6};
      lens.calibration->temperature = model;
    }
    if (Is(Kind::FocusBacklash)) {
      made.backlash_steps = std::round(Uniform(5, 40));
      focus.backlash = made.backlash_steps;
      focus.approach_near = Uniform(0, 1) < 0.5;
    }
    if (Is(Kind::IrisBacklash)) {
      made.iris_backlash_steps = std::round(Uniform(1, 9));
      lens.config.axes[Axis::Iris].backlash = made.iris_backlash_steps;
    }
    Calibrate(made, *lens.calibration);
    return lens;
  }

  static void Calibrate(const sim::LensSettings& made, rig::Calibration& calibration) {
    rig::FocusCurve curve;
    curve.points.push_back({Native{0.0}, Metres{made.min_extension_mm * 1e-3}, std::nullopt});
    curve.points.push_back({Native{made.steps - 1.0}, Metres{made.max_extension_mm * 1e-3}, std::nullopt});
    calibration.focus.push_back(curve);
    if (made.breathing == 0.0) return;
    const double span = made.max_extension_mm - made.min_extension_mm;
    for (const double e : {made.min_extension_mm, made.max_extension_mm}) {
      calibration.breathing.push_back({Metres{e * 1e-3}, 1.0 + made.breathing * e / span});
    }
  }

  // ---- what is true -------------------------------------------------------------------------------------------------

  /// A thin lens as the simulator has it.
  struct Thin {
    double f = 0.0, z = 0.0, a = 0.0;
    double ahead = 0.0;  ///< how far its centre is from where distances start
    double Seen(const optics::PlanDepth& depth) const {
      return depth.is_vergence ? depth.number.value : 1.0 / (depth.number.value - ahead);
    }
    double Blur(double u) const { return std::abs(a * (z * (1.0 / f - u) - 1.0)); }
    double FocusD() const { return 1.0 / f - 1.0 / z; }
  };
  static Thin True(const sim::TrueState& state) {
    return {state.optics.focal_length_m, state.optics.sensor_distance_m, state.optics.aperture_diameter_m,
            state.optics.centre_shift_m};
  }
  /// With focus at a step and at an f-number, from the scene alone.
  static Thin At(const sim::LensSettings& made, double nominal_f, double step, double n) {
    const double along = step / (made.steps - 1.0);
    const double span = made.max_extension_mm - made.min_extension_mm;
    const double mechanical = 1e-3 * (made.min_extension_mm + along * span);
    const double f = nominal_f * (1.0 + made.breathing * mechanical / (1e-3 * span));
    const double e = mechanical + 1e-6 * made.drift_um_per_c * (made.temperature_c - 20.0);
    const double span_f = made.max_focal_length_mm - made.min_focal_length_mm;
    const double zoomed = span_f > 0.0 ? (1e3 * nominal_f - made.min_focal_length_mm) / span_f : 0.0;
    return {f, f + e, nominal_f / n, 1e-3 * made.centre_shift_mm * zoomed};
  }
  static bool IsSharp(const optics::BlurLimit& limit) { return limit.kind == optics::LimitKind::Sharp; }
  /// The blur that counts for a limit: the greatest of a sharp one, the least of a blurred one, whose sides are given.
  static double Counts(const optics::BlurLimit& limit, const Thin& lens) {
    const double one = lens.Seen(limit.depths[0].one_end), other = lens.Seen(limit.depths[0].other_end);
    if (IsSharp(limit)) return std::max(lens.Blur(one), lens.Blur(other));
    const double near = std::max(one, other), far = std::min(one, other), plane = lens.FocusD();
    if (limit.side == optics::Side::Behind) return plane > near ? lens.Blur(near) : 0.0;
    return plane < far ? lens.Blur(far) : 0.0;
  }
  static double Ratio(const optics::BlurLimit& limit, const Thin& lens) {
    const double blur = Counts(limit, lens);
    return IsSharp(limit) ? blur / limit.limit.value : limit.limit.value / std::max(blur, 1e-12);
  }

  /// Some pair of positions leaves a fifth of every limit with each axis a step away.
  bool Possible(const Lens& lens, double nominal_f, const std::vector<optics::BlurLimit>& limits) {
    const sim::LensSettings& made = lens.scene->lens;
    const double iris_step = std::log(made.max_f_number / made.min_f_number) / (made.iris_steps - 1.0);
    const double zoom_step = made.zooms() ? 1e-6 * (made.max_focal_length_mm - made.min_focal_length_mm) : 0.0;
    const bool up = lens.config.axes[Axis::Focus].approach_near.value_or(true);
    const double low = up ? made.backlash_steps + 1 : 1, high = made.steps - 2.0 - (up ? 0.0 : made.backlash_steps);
    for (double step = low; step <= high; ++step) {
      double least = made.min_f_number, most = made.max_f_number;
      for (const double zoomed : {nominal_f - zoom_step, nominal_f + zoom_step}) {
        for (const double place : {step - 1.0, step + 1.0}) {
          const Thin open = At(made, zoomed, place, 1.0);
          for (const optics::BlurLimit& limit : limits) {
            const double blur = Counts(limit, open);  // times N
            if (IsSharp(limit)) {
              least = std::max(least, kPossible * blur / limit.limit.value);
            } else {
              most = std::min(most, blur / (kPossible * limit.limit.value));
            }
          }
        }
      }
      // An f-number with a whole step to spare either way.
      const double first = std::ceil(std::log(least / made.min_f_number) / iris_step - 1e-9) + 1.0;
      const double last = std::floor(std::log(most / made.min_f_number) / iris_step + 1e-9) - 1.0;
      const double from = std::max(first, made.iris_backlash_steps + 1.0);
      if (from <= std::min(last, made.iris_steps - 2.0)) return true;
    }
    return false;
  }

  // ---- one plan -----------------------------------------------------------------------------------------------------

  void Drive(rig::Rig& rig, SteppedClock& clock, const bool& done) {
    for (int i = 0; i < 200000 && !done; ++i) {
      const Instant next = rig.Step(clock.Now());
      if (!done)
        clock.Advance(
            std::clamp<Duration>(next - clock.Now(), std::chrono::microseconds(100), std::chrono::milliseconds(5)));
    }
    ASSERT_TRUE(done);
  }
  void Move(rig::Rig& rig, SteppedClock& clock, const std::vector<std::pair<Axis, double>>& moves) {
    std::size_t left = moves.size();
    bool done = moves.empty();
    for (const auto& [axis, native] : moves) {
      rig.Move(axis, {rig::Target::Kind::Native, native, std::nullopt}, [&](const Result<rig::MoveOutcome>& outcome) {
        EXPECT_TRUE(outcome.has_value());
        done = --left == 0;
      });
    }
    Drive(rig, clock, done);
  }
  /// Somewhere, from wherever it was.
  void Wander(const Lens& lens, rig::Rig& rig, SteppedClock& clock) {
    const sim::LensSettings& made = lens.scene->lens;
    std::vector<std::pair<Axis, double>> moves;
    moves.emplace_back(Axis::Focus, std::floor(Uniform(0, made.steps - 1)));
    moves.emplace_back(Axis::Iris, std::floor(Uniform(0, made.iris_steps - 1)));
    if (made.zooms()) {
      const double span = made.max_focal_length_mm - made.min_focal_length_mm;
      moves.emplace_back(Axis::Zoom, made.min_focal_length_mm + 1e-3 * span * std::floor(Uniform(0, 1000)));
    }
    Move(rig, clock, moves);
  }

  /// Limits around a setting of the lens, some with room and some without.
  std::vector<optics::BlurLimit> RandomLimits(const sim::LensSettings& made, double nominal_f) {
    const double n = Log(made.min_f_number, made.max_f_number);
    const Thin there = At(made, nominal_f, Uniform(0, made.steps - 1.0), n);
    const double closest = 0.8 / nominal_f;
    const double slope = there.a * there.z;
    std::vector<optics::BlurLimit> limits;
    const int count = std::uniform_int_distribution(1, 4)(random_);
    for (int k = 0; k < count; ++k) {
      const bool sharp = k == 0 || Uniform(0, 1) < 0.4;
      const double typical = Log(4e-6, 2e-4);
      optics::BlurLimit limit{.name = "limit" + std::to_string(k),
                              .kind = sharp ? optics::LimitKind::Sharp : optics::LimitKind::Blurred,
                              .depths = {},
                              .limit = {}};
      const double away = Uniform(sharp ? -0.6 : 1.0, sharp ? 0.6 : 6.0) * typical / slope;
      const bool behind = Uniform(0, 1) < 0.5;
      double one = there.FocusD() + (behind ? -away : away);
      double other = one + Uniform(-0.5, 0.5) * typical / slope;
      one = std::clamp(one, 0.0, closest), other = std::clamp(other, 0.0, closest);
      limit.side = sharp ? optics::Side::Either : behind ? optics::Side::Behind : optics::Side::Front;
      const bool measured = made.centre_shift_mm != 0.0 && Uniform(0, 1) < 0.5 && std::min(one, other) > 0.0;
      const auto depth = [&](double u) {
        return measured ? optics::PlanDepth::Distance(1.0 / u + there.ahead) : optics::PlanDepth::Vergence(u);
      };
      limit.depths = {{depth(one), depth(other)}};
      const double blur = std::max(Counts(limit, there), 1e-6);
      limit.limit = sharp ? blur * Log(0.35, 3.0) : blur * Log(0.25, 2.0);
      limits.push_back(std::move(limit));
    }
    return limits;
  }

  void JudgePlan(const Lens& lens, rig::Rig& rig, SteppedClock& clock, const sim::Truth& truth) {
    Wander(lens, rig, clock);
    const double nominal_f = True(truth.Now()).a * truth.Now().f_number;
    const auto planning = PlanningOf(rig, lens.config);
    ASSERT_TRUE(planning.has_value());
    proto::LensRequest asked{.plan = planning->defaults};
    asked.plan.limits = RandomLimits(lens.scene->lens, nominal_f);
    asked.plan.sensor_tolerance = asked.plan.f_number_tolerance = optics::Number(0.0);
    if (Uniform(0, 1) < 0.3) asked.plan.objective = optics::Objective::Sharp;
    const auto plan = PlanFor(*planning, asked, rig.GetStatus());
    ASSERT_TRUE(plan.has_value()) << plan.error().message;
    ++plans;
    const bool was_possible = Possible(lens, nominal_f, asked.plan.limits);
    possible += was_possible;
    if (!plan->answer.plan.feasible) return;
    Move(rig, clock, {{Axis::Focus, plan->focus->value}, {Axis::Iris, plan->iris->value}});
    const rig::Status now = rig.GetStatus();
    const auto check = CheckNow(now, lens.config, asked);
    ASSERT_TRUE(check.has_value());
    const Thin is = True(truth.Now());
    CompareWithStatus(plan->answer.plan, now);
    for (std::size_t k = 0; k < asked.plan.limits.size(); ++k) {
      const optics::BlurLimit& limit = asked.plan.limits[k];
      const double blur = Counts(limit, is), worst = check->limits[k].worst.value;
      constexpr double kRounding = 1e-9;  // metres: a thousandth of a micrometre
      if (IsSharp(limit) ? blur > worst + kRounding : blur < worst - kRounding)
        TellBreach(lens, limit, blur, worst, now);
      if (check->feasible && Ratio(limit, is) > kFalse) ++wrong;
    }
    reached += check->feasible;
    found += was_possible && check->feasible;
  }

  void TellBreach(const Lens& lens, const optics::BlurLimit& limit, double blur, double worst, const rig::Status& now) {
    ++beyond_bound;
    const sim::LensSettings& made = lens.scene->lens;
    std::printf(
        "plan %d: %s blurs %.9g um where the bound is %.9g; f %.6g..%.6g mm, f/%.4g, extension %.6g mm of "
        "%.4g..%.4g in %d steps, breathing %.4g, %.4g C with %.4g um/C, backlash %g and %g\n",
        plans, limit.name.c_str(), blur * 1e6, worst * 1e6, made.min_focal_length_mm, made.max_focal_length_mm,
        now.f_number->value, now.extension->value * 1e3, made.min_extension_mm, made.max_extension_mm, made.steps,
        made.breathing, made.temperature_c, made.drift_um_per_c, made.backlash_steps, made.iris_backlash_steps);
  }

  void CompareWithStatus(const optics::PlanAnswer& plan, const rig::Status& now) {
    const auto same = [](double a, double b) { return std::abs(a - b) <= 1e-9 * std::abs(b) + 1e-12; };
    if (same(plan.focal_length.value, now.focal_length->value) && same(plan.extension.value, now.extension->value) &&
        same(plan.f_number.value, now.f_number->value)) {
      return;
    }
    ++other_than_status;
  }

  Kind kind_;
  std::mt19937_64 random_;
};

/// LENSD_PLANS: how many of all kinds together, whatever the level.
int PlansAKind() {
  const char* const plans = std::getenv("LENSD_PLANS");
  const long all = plans != nullptr ? std::atol(plans) : testing::ByLevel(350, 1000, 10000);
  return static_cast<int>(all / static_cast<long>(std::size(kKinds)));
}

class PlanJudge : public ::testing::TestWithParam<Kind> {};

TEST_P(PlanJudge, WhatIsReachedIsTrueAndWhatIsPossibleIsFound) {
  Judge judge(GetParam(), 1 + static_cast<std::uint64_t>(GetParam()));
  while (judge.plans < PlansAKind() && !HasFatalFailure()) judge.JudgeLens();
  std::printf(
      "plans %d, reached %d, of those false %d, limits beyond their bound %d, possible with a fifth to spare %d, "
      "of those found %d\n",
      judge.plans, judge.reached, judge.wrong, judge.beyond_bound, judge.possible, judge.found);
  EXPECT_EQ(judge.wrong, 0);
  EXPECT_EQ(judge.beyond_bound, 0);
  EXPECT_EQ(judge.other_than_status, 0);
  EXPECT_GE(judge.found, 0.95 * judge.possible);
  EXPECT_GE(judge.possible, judge.plans / 10);
}

std::string NameOf(const ::testing::TestParamInfo<Kind>& info) {
  static constexpr const char* kNames[] = {"Fixed",         "Zoom",         "Breathing", "Drift",
                                           "FocusBacklash", "IrisBacklash", "Several"};
  return kNames[static_cast<std::size_t>(info.param)];
}
INSTANTIATE_TEST_SUITE_P(Kinds, PlanJudge, ::testing::ValuesIn(kKinds), NameOf);

}  // namespace
}  // namespace lensd::daemon
