// Refused plans of simulated lenses against twins of these lenses, each of which lacks one thing that may prevent a
// plan: a twin has a plan exactly where the refusal names what it lacks. Limits a hair wider and a hair tighter have to
// agree, else the draw says nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <random>
#include <string>

#include "planning/plan_causes.h"
#include "planning/zoom_choice.h"
#include "sim/world.h"
#include "test_level.h"

namespace lensd::daemon {
namespace {

using drivers::Axis;

/// What a lens is made as.
struct Made {
  sim::LensSettings lens;
  double place = 0.0;          ///< of focus, steps
  double backlash = 0.0;       ///< of focus, not known to lensd, steps
  double iris_backlash = 0.0;  ///< likewise
  double curve_error = 0.0;    ///< of the calibration, metres
  double rest_steps = 1.0;     ///< how many of its steps are one of the lens that it is the twin of
};

struct Lens {
  rig::RigConfig config;
  Planning planning;
  rig::Status now;
};

std::shared_ptr<rig::Calibration> CalibrationOf(const Made& made) {
  auto calibration = std::make_shared<rig::Calibration>();
  rig::FocusCurve curve;
  curve.error = Metres{made.curve_error};
  curve.points.push_back({Native{0.0}, Metres{made.lens.min_extension_mm * 1e-3}, std::nullopt});
  curve.points.push_back({Native{made.lens.steps - 1.0}, Metres{made.lens.max_extension_mm * 1e-3}, std::nullopt});
  calibration->focus.push_back(curve);
  return calibration;
}

Lens Build(const Made& made) {
  auto scene = std::make_shared<sim::Scene>();
  scene->camera.width = scene->camera.height = 8;
  scene->surfaces.push_back({.shape = sim::PlaneShape{}, .region = {}, .paint = sim::ConstantPaint{}});
  scene->lens = made.lens;
  scene->lens.feedback = drivers::Feedback::Encoder;
  SteppedClock clock;
  auto world = sim::OpenWorld(scene, clock);
  EXPECT_TRUE(world.has_value()) << world.error().message;
  Lens lens;
  auto rig = rig::Rig::Create(lens.config, std::move(world->device), clock, CalibrationOf(made));
  EXPECT_TRUE(rig.has_value()) << rig.error().message;
  for (int i = 0; i < 40; ++i) {
    (*rig)->Step(clock.Now());
    clock.Advance(std::chrono::milliseconds(5));
  }
  lens.now = (*rig)->GetStatus();
  for (const auto& [axis, backlash] :
       {std::pair(Axis::Focus, made.backlash), std::pair(Axis::Iris, made.iris_backlash)}) {
    if (!lens.now.axes[axis]) continue;
    rig::Arrival& arrival = lens.now.axes[axis]->arrival;
    if (axis == Axis::Focus) arrival.position = Native{made.place};
    arrival.backlash = arrival.not_taken_up = backlash;
    arrival.overshoots = false;
    arrival.rest *= made.rest_steps;
  }
  auto planning = PlanningOf(**rig, lens.config);
  EXPECT_TRUE(planning.has_value());
  lens.planning = *std::move(planning);
  return lens;
}

/// What is asked, as far as it is asked: the rest is the lens' own.
struct Asked {
  std::vector<optics::BlurLimit> limits;
  std::optional<double> sensor_tolerance, f_number_tolerance;
  std::optional<std::pair<double, double>> f_numbers, extensions;
  std::optional<double> focus;
  std::optional<std::pair<double, double>> focal_lengths;
};

proto::LensRequest RequestOf(const Asked& asked, const Planning& planning, double wider = 1.0) {
  proto::LensRequest request{.plan = planning.defaults};
  request.plan.limits = asked.limits;
  for (optics::BlurLimit& limit : request.plan.limits) {
    const double factor = limit.kind == optics::LimitKind::Sharp ? wider : 1.0 / wider;
    limit.limit = limit.limit.value * factor;
  }
  request.own = {!asked.extensions, !asked.extensions, !asked.sensor_tolerance, !asked.f_number_tolerance};
  if (asked.sensor_tolerance) request.plan.sensor_tolerance = *asked.sensor_tolerance;
  if (asked.f_number_tolerance) request.plan.f_number_tolerance = *asked.f_number_tolerance;
  if (asked.f_numbers) request.plan.f_numbers = {asked.f_numbers->first, asked.f_numbers->second};
  if (asked.extensions) request.plan.extensions = {asked.extensions->first, asked.extensions->second};
  if (asked.focus) request.plan.focus = optics::PlanDepth::Vergence(*asked.focus);
  if (asked.focal_lengths) {
    request.focal_lengths = std::pair(Metres{asked.focal_lengths->first}, Metres{asked.focal_lengths->second});
  }
  return request;
}

/// A refused plan, or one that there is.
struct Answer {
  proto::LensRequest request;
  std::optional<ZoomedPlanning> zoomed;
  Result<LensPlan> plan;
  bool possible() const { return plan && plan->answer.plan.feasible; }
};
Answer AnswerOf(const Lens& lens, const Asked& asked, double wider = 1.0) {
  Answer answer{RequestOf(asked, lens.planning, wider), std::nullopt, Fail(Code::Busy, "")};
  if (answer.request.focal_lengths) {
    auto zoomed = PlanningForZoom(lens.planning.lens, lens.config, answer.request, lens.now, {});
    if (!zoomed) {
      answer.plan = PassOn(zoomed);
      return answer;
    }
    answer.request.plan = zoomed->request;
    answer.zoomed = *std::move(zoomed);
  }
  answer.plan = PlanFor(answer.zoomed ? answer.zoomed->planning : lens.planning, answer.request, lens.now);
  return answer;
}

enum class Verdict { Impossible, Possible, Unsure };
constexpr double kHair = 1.04;
Verdict Judge(const Lens& lens, const Asked& asked) {
  const bool wide = AnswerOf(lens, asked, kHair).possible(), tight = AnswerOf(lens, asked, 1.0 / kHair).possible();
  return wide != tight ? Verdict::Unsure : wide ? Verdict::Possible : Verdict::Impossible;
}

/// The number after the last "f/" or "length".
double NumberIn(const std::string& reason, const std::string& after) {
  const auto at = reason.rfind(after);
  return at == std::string::npos ? NAN : std::strtod(reason.c_str() + at + after.size(), nullptr);
}

class Draws {
 public:
  explicit Draws(std::uint64_t seed) : random_(seed) {}

  std::map<std::string, int> named;
  int refused = 0, unsure = 0, judged = 0, wrong = 0;

  void Once() {
    const Made made = AnyLens();
    const Lens lens = Build(made);
    for (int i = 0; i < 4; ++i) {
      const Asked asked = AnyQuestion(made);
      const Answer answer = AnswerOf(lens, asked);
      if (!answer.plan || answer.possible()) continue;
      ++refused;
      const Planning& planning = answer.zoomed ? answer.zoomed->planning : lens.planning;
      static const std::string kName = "bike";
      const auto causes = CausesOf({planning, answer.request, lens.now, lens.config, answer.plan->answer, kName}, {});
      JudgeAll(made, lens, asked, causes);
    }
  }

 private:
  double Uniform(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
  double Log(double low, double high) { return std::exp(Uniform(std::log(low), std::log(high))); }
  bool Chance(double share) { return Uniform(0, 1) < share; }

  Made AnyLens() {
    Made made;
    sim::LensSettings& lens = made.lens;
    lens.min_focal_length_mm = lens.max_focal_length_mm = Log(8.0, 85.0);
    if (Chance(0.15)) lens.max_focal_length_mm *= Uniform(1.3, 2.5);
    lens.min_f_number = lens.max_f_number = lens.initial_f_number = Uniform(1.2, 4.0);
    if (Chance(0.7)) lens.max_f_number *= Uniform(1.3, 8.0);
    lens.iris_steps = static_cast<int>(Log(4, 60));
    lens.max_extension_mm = lens.min_focal_length_mm * Log(0.01, 0.1);
    if (Chance(0.3)) lens.min_extension_mm = 0.3 * lens.max_extension_mm;
    lens.steps = static_cast<int>(Log(20, 300));
    made.place = std::floor(Uniform(0, lens.steps - 1));
    if (Chance(0.4)) made.backlash = std::round(0.1 * lens.steps);
    if (Chance(0.5)) made.iris_backlash = std::ceil(Uniform(0.1, 0.5) * lens.iris_steps);
    if (Chance(0.3)) made.curve_error = 1e-3 * lens.max_extension_mm * Log(0.003, 0.1);
    return made;
  }

  /// Limits around a setting in the lens' reach or somewhat out of it.
  Asked AnyQuestion(const Made& made) {
    const sim::LensSettings& lens = made.lens;
    Asked asked;
    const double f = 1e-3 * lens.min_focal_length_mm, n = Log(0.6 * lens.min_f_number, 2.0 * lens.max_f_number);
    const double travel = 1e-3 * lens.max_extension_mm;
    const double e = travel * (Chance(0.7) ? Uniform(0.0, 1.0) : Uniform(0.0, 1.8));
    const double plane = e / (f * (f + e)), slope = f / n * (f + e), closest = 0.7 / f;
    const int count = std::uniform_int_distribution(1, 3)(random_);
    for (int k = 0; k < count; ++k) {
      const bool sharp = k == 0 || Chance(0.5);
      const double blur = Log(2e-6, 1e-4);
      const double away = (Chance(0.5) ? 1.0 : -1.0) * blur / slope * (sharp ? Uniform(0.0, 1.2) : Uniform(0.8, 3.0));
      const auto depth = [&](double u) { return optics::PlanDepth::Vergence(std::clamp(u, 0.0, closest)); };
      const double one = plane + away, other = sharp ? one - away * Uniform(0.0, 2.0) : one;
      asked.limits.push_back({.name = "limit" + std::to_string(k),
                              .kind = sharp ? optics::LimitKind::Sharp : optics::LimitKind::Blurred,
                              .depths = {{depth(one), depth(other)}},
                              .limit = blur,
                              .side = sharp      ? optics::Side::Either
                                      : away > 0 ? optics::Side::Front
                                                 : optics::Side::Behind});
    }
    if (Chance(0.5)) asked.sensor_tolerance = Chance(0.5) ? 0.0 : travel * Log(0.003, 0.2);
    if (Chance(0.5)) asked.f_number_tolerance = Chance(0.5) ? 0.0 : Uniform(0.01, 0.4);
    if (Chance(0.25)) {
      const double low = Log(lens.min_f_number, lens.max_f_number);
      asked.f_numbers = {low, Chance(0.5) ? Log(low, lens.max_f_number) : lens.max_f_number * Uniform(1.1, 3.0)};
      if (Chance(0.3)) asked.f_numbers->first = lens.min_f_number / Uniform(1.1, 3.0);
    }
    if (Chance(0.2)) {
      const double low = Uniform(1e-3 * lens.min_extension_mm, travel);
      asked.extensions = {low, Uniform(low, travel)};
    }
    if (Chance(0.2)) asked.focus = plane * Uniform(0.9, 1.1);
    if (lens.zooms() && Chance(0.5)) {
      const double low = Uniform(lens.min_focal_length_mm, lens.max_focal_length_mm);
      asked.focal_lengths = {1e-3 * low, 1e-3 * std::min(1.05 * low, lens.max_focal_length_mm)};
    }
    return asked;
  }

  // ---- twins --------------------------------------------------------------------------------------------------------

  void JudgeAll(const Made& made, const Lens& lens, const Asked& asked, const std::vector<optics::PlanCause>& causes) {
    std::map<std::string, std::string> reasons;
    for (const auto& [cause, reason] : causes) {
      EXPECT_TRUE(reasons.emplace(cause, reason).second) << cause << " is named twice";
      ++named[cause];
    }
    const auto expect = [&](const std::string& cause, Verdict verdict) {
      verdict == Verdict::Unsure ? ++unsure : ++judged;
      if (verdict == Verdict::Unsure) return;
      const auto found = reasons.find(cause);
      if ((found != reasons.end()) == (verdict == Verdict::Possible)) return;
      ++wrong;
      const auto [low, high] = asked.f_numbers.value_or(std::pair(0.0, 0.0));
      std::printf("%s in refusal %d%s, asked for f/%g to f/%g: %s\n", cause.c_str(), refused,
                  asked.focus ? " of a fixed focus" : "", low, high,
                  found == reasons.end() ? "not named" : found->second.c_str());
    };
    const auto twin = [&](const std::string& cause, const auto& lift) {
      Made other = made;
      lift(other);
      expect(cause, Judge(Build(other), asked));
    };
    const auto without = [&](const std::string& cause, const auto& lift) {
      Asked other = asked;
      lift(other);
      expect(cause, Judge(lens, other));
    };
    if (asked.focal_lengths) return JudgeZoom(made, lens, asked, reasons, expect);  // the others choose again
    if (made.backlash > 0.0) twin("focusUncertainty", [](Made& other) { other.backlash = 0.0; });
    if (made.iris_backlash > 0.0) twin("irisUncertainty", [](Made& other) { other.iris_backlash = 0.0; });
    if (made.curve_error > 0.0) twin("calibration", [](Made& other) { other.curve_error = 0.0; });
    without("sensorTolerance", [](Asked& other) { other.sensor_tolerance = 0.0; });
    without("fNumberTolerance", [](Asked& other) { other.f_number_tolerance = 0.0; });
    without("focus", [](Asked& other) { other.focus.reset(); });
    without("fNumber", [](Asked& other) { other.f_numbers.reset(); });
    without("extension", [](Asked& other) { other.extensions.reset(); });
    if (!made.lens.zooms()) {
      JudgeSteps(made, lens, asked, expect);
      JudgeTravel(made, asked, expect);
      JudgeAperture(made, lens, asked, reasons, expect);
    } else {
      JudgeZoom(made, lens, asked, reasons, expect);
    }
  }

  /// The twin has very fine steps, of which many are as uncertain as one of the lens.
  template <class Expect>
  static void JudgeSteps(const Made& made, const Lens& lens, Asked asked, const Expect& expect) {
    constexpr int kFiner = 64;
    Made other = made;
    other.rest_steps = kFiner;
    other.place *= kFiner;
    other.backlash *= kFiner;
    other.iris_backlash *= kFiner;
    other.lens.steps = (made.lens.steps - 1) * kFiner + 1;
    other.lens.iris_steps = (made.lens.iris_steps - 1) * kFiner + 1;
    const optics::PlanRequest& own = lens.planning.defaults;
    if (!asked.sensor_tolerance) asked.sensor_tolerance = own.sensor_tolerance.value;
    if (!asked.f_number_tolerance) asked.f_number_tolerance = own.f_number_tolerance.value;
    if (!asked.focus) expect("positions", Judge(Build(other), asked));
  }

  /// The twin goes from infinity to life size in the steps of the lens.
  template <class Expect>
  static void JudgeTravel(const Made& made, Asked asked, const Expect& expect) {
    const sim::LensSettings& lens = made.lens;
    const double step = (lens.max_extension_mm - lens.min_extension_mm) / (lens.steps - 1.0);
    const double below = std::floor(lens.min_extension_mm / step);
    const double above = std::floor((lens.min_focal_length_mm - lens.max_extension_mm) / step);
    Made other = made;
    other.place += below;
    other.lens.min_extension_mm -= below * step;
    other.lens.max_extension_mm += above * step;
    other.lens.steps += static_cast<int>(below + above);
    const Lens longer = Build(other);
    if (!asked.sensor_tolerance) asked.sensor_tolerance = 0.5e-3 * step + made.curve_error;
    expect("travel", Judge(longer, asked));
  }

  /// Of a lens without an iris twins have other apertures; of one with an iris the twin has many more, as far apart.
  /// An end that is the lens' own counts as not asked for.
  template <class Expect>
  static void JudgeAperture(const Made& made, const Lens& lens, Asked asked,
                            const std::map<std::string, std::string>& reasons, const Expect& expect) {
    if (made.lens.min_f_number < made.lens.max_f_number) {
      const double ratio = std::log(made.lens.max_f_number / made.lens.min_f_number) / (made.lens.iris_steps - 1.0);
      const double wider = std::floor(std::log(made.lens.min_f_number / 0.5) / ratio);
      const double smaller = std::floor(std::log(128.0 / made.lens.max_f_number) / ratio);
      Made other = made;
      other.lens.min_f_number *= std::exp(-wider * ratio);
      other.lens.max_f_number *= std::exp(smaller * ratio);
      other.lens.iris_steps += static_cast<int>(wider + smaller);
      if (other.iris_backlash > 0.0) return;  // where its iris stands differs
      return expect("aperture", Judge(Build(other), asked));
    }
    const double own = made.lens.min_f_number;
    double least = 0.5, most = 128.0;
    if (asked.f_numbers && std::abs(asked.f_numbers->first / own - 1.0) > 1e-3) least = asked.f_numbers->first;
    if (asked.f_numbers && std::abs(asked.f_numbers->second / own - 1.0) > 1e-3) most = asked.f_numbers->second;
    if (asked.f_numbers) asked.f_numbers = {least, most};
    const auto has = [&](double f_number, double wider) {
      Lens other = lens;
      const FNumber n{f_number};
      other.planning.positions.iris = {{n, n, n}};
      other.planning.defaults.f_numbers = {f_number, f_number};
      return AnswerOf(other, asked, wider).possible();
    };
    if (const auto found = reasons.find("aperture"); found != reasons.end()) {
      const double said = NumberIn(found->second, "f/");
      EXPECT_GE(said, least / 1.03) << found->second;
      EXPECT_LE(said, most * 1.03) << found->second;
      return expect("aperture", has(said, kHair) ? Verdict::Possible : Verdict::Impossible);
    }
    for (double n = least; n <= most; n *= 1.15) {
      if (has(n, 1.0 / kHair)) return expect("aperture", Verdict::Possible);
    }
    expect("aperture", Verdict::Impossible);
  }

  template <class Expect>
  static void JudgeZoom(const Made& made, const Lens& lens, Asked asked,
                        const std::map<std::string, std::string>& reasons, const Expect& expect) {
    const auto has = [&](double focal_length, double wider) {
      asked.focal_lengths = std::pair(focal_length, focal_length);
      return AnswerOf(lens, asked, wider).possible();
    };
    if (const auto found = reasons.find("zoom"); found != reasons.end()) {
      const double there = 1e-3 * NumberIn(found->second, ": ");
      return expect("zoom", has(there, kHair) ? Verdict::Possible : Verdict::Impossible);
    }
    constexpr int kPlaces = 8;
    for (int i = 0; i <= kPlaces; ++i) {
      const double share = static_cast<double>(i) / kPlaces;
      const double f = std::lerp(made.lens.min_focal_length_mm, made.lens.max_focal_length_mm, share);
      if (has(1e-3 * f, 1.0 / kHair)) return expect("zoom", Verdict::Possible);
    }
    expect("zoom", Verdict::Impossible);
  }

  std::mt19937_64 random_;
};

TEST(PlanCauses, AreThoseWithoutWhichAloneThereIsAPlan) {
  Draws draws(41);
  const auto count = testing::ByLevel(16, 16, 300);
  for (int i = 0; i < count && !::testing::Test::HasFatalFailure(); ++i) draws.Once();
  std::printf("%d refusals, %d causes judged, %d too close to say\n", draws.refused, draws.judged, draws.unsure);
  for (const auto& [cause, times] : draws.named) std::printf("%s is named %d times\n", cause.c_str(), times);
  constexpr std::size_t kAll = 12, kMost = 6;  // causes that are drawn at all
  EXPECT_GE(draws.named.size(), testing::ByLevel(0, 0, 1) == 1 ? kAll : kMost);
  // Where to look beyond the travel is a guess that takes no account of steps: it may miss one in thousands.
  EXPECT_LE(draws.wrong, draws.judged / 1000);
  EXPECT_LT(draws.unsure, draws.judged / 4);
}

}  // namespace
}  // namespace lensd::daemon
