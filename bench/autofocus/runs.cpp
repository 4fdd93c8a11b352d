// Autofocus runs through the rig on stepped clocks, in parallel; the truth is read after each, for scoring alone.
#include "bench/autofocus/runs.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <variant>

#include "bench/autofocus/late_lens.h"
#include "rig/rig.h"
#include "sim/world.h"

namespace lensd::bench {
namespace {

/// SplitMix64: a well mixed number from a counter.
std::uint64_t Mixed(std::uint64_t value) {
  value += 0x9E3779B97F4A7C15ULL;
  value = (value ^ (value >> 30)) * 0xBF58476D1CE4E5B9ULL;
  value = (value ^ (value >> 27)) * 0x94D049BB133111EBULL;
  return value ^ (value >> 31);
}

/// `sway_d`: of the subject when the run ended.
void Score(const sim::Truth& truth, const sim::Scene& scene, double sway_d, AutofocusRunResult& result) {
  const sim::TrueState state = truth.Now();
  result.end_extension_m = state.extension_m;
  result.half_dof_d = sim::HalfDepthOfFieldD(scene.camera, state);
  result.error_d = std::numeric_limits<double>::infinity();
  for (const sim::SubjectDepth& subject : truth.subjects()) {
    result.error_d = std::min(result.error_d, std::abs(state.focal_plane_d - subject.vergence_d - sway_d));
  }
}

void Note(const rig::AutofocusOutcome& outcome, AutofocusRunResult& result) {
  result.end_steps = outcome.position.value;
  result.focused = outcome.focused;
  result.frames = outcome.frames;
  result.moves = outcome.moves;
  result.elapsed = outcome.elapsed;
  result.cpu = outcome.cpu;
  result.reason = outcome.reason;
  if (outcome.slope) {
    result.log_slope = outcome.slope->log_factor;
    result.uneven = outcome.slope->uneven;
  }
  result.candidates = outcome.candidates.size();
}

/// Steps that focus on what lies at `vergence_d`, the lens otherwise as it is.
double FocusedAt(const sim::Truth& truth, const sim::Scene& scene, double vergence_d) {
  const sim::LensSettings& lens = scene.lens;
  const double f = truth.Now().optics.focal_length_m;
  const double step_m = 1e-3 * (lens.max_extension_mm - lens.min_extension_mm) / (lens.steps - 1.0);
  return (1.0 / (1.0 / f - vergence_d) - f - 1e-3 * lens.min_extension_mm) / step_m;
}

/// What it takes from the run's start to the subject nearest to its end for one who knows where that is: a move, and
/// two frames to show it. Zero where there is no subject.
Result<Duration> ForOneWhoKnows(const std::shared_ptr<sim::Pictures>& pictures, const sim::WorldOptions& options,
                                const sim::Truth& ended) {
  const sim::Scene& scene = pictures->scene();
  if (ended.subjects().empty()) return Duration::zero();
  const double focal_plane_d = ended.Now().focal_plane_d;
  const auto& nearest = *std::ranges::min_element(
      ended.subjects(), {}, [&](const sim::SubjectDepth& it) { return std::abs(it.vergence_d - focal_plane_d); });
  const double steps = std::clamp(std::round(FocusedAt(ended, scene, nearest.vergence_d)), 0.0, scene.lens.steps - 1.0);
  SteppedClock clock;
  auto world = sim::OpenWorld(std::shared_ptr<const sim::Scene>(pictures, &scene), clock, options);
  if (!world) return PassOn(world);
  rig::RigConfig config;
  config.optics = world->device.optics;
  auto rig = rig::Rig::Create(std::move(config), std::move(world->device), clock);
  if (!rig) return PassOn(rig);
  std::optional<Instant> arrived;
  (*rig)->Move(drivers::Axis::Focus, {.value = steps, .from = {}}, [&](const auto&) { arrived = clock.Now(); });
  constexpr Instant kNoMoveIsLonger{std::chrono::seconds(100)};
  while (!arrived && clock.Now() < kNoMoveIsLonger) clock.AdvanceTo((*rig)->Step(clock.Now()));
  if (!arrived) return Fail(Code::Internal, "a move did not end by itself");
  const std::chrono::duration<double> two_frames{2.0 / scene.camera.frame_rate_hz};
  return arrived->time_since_epoch() + std::chrono::duration_cast<Duration>(two_frames);
}

/// How far off the answer's own place of the subject is. From where the lens stands, so that wrong optics count by what
/// they do to that small distance only.
void ScoreSubject(const rig::AutofocusOutcome& outcome, const sim::Truth& truth, AutofocusRunResult& result) {
  if (!outcome.focused || !outcome.subject || !outcome.subject->vergence || truth.subjects().empty()) return;
  const double moves_d = (*outcome.subject->vergence - *outcome.vergence).value;
  double off_d = std::numeric_limits<double>::infinity();
  for (const sim::SubjectDepth& subject : truth.subjects()) {
    const double one_d = truth.Now().focal_plane_d - subject.vergence_d + moves_d;
    if (std::abs(one_d) < std::abs(off_d)) off_d = one_d;
  }
  if (outcome.method == "defocus") result.subject_px = 2.0 * off_d / result.half_dof_d;
  if (outcome.subject->sigma) result.off_sigmas = off_d / outcome.subject->sigma->value;
}

/// Signed blur of the first subject with the lens at `steps`, px of diameter.
double BlurAt(const sim::Truth& truth, const sim::Scene& scene, double steps) {
  if (truth.subjects().empty()) return 0.0;
  const sim::LensSettings& lens = scene.lens;
  const sim::TrueState state = truth.Now();
  const double f = state.optics.focal_length_m;
  const double step_m = 1e-3 * (lens.max_extension_mm - lens.min_extension_mm) / (lens.steps - 1.0);
  const double extension_m = 1e-3 * lens.min_extension_mm + steps * step_m;
  const double focused_m = 1.0 / (1.0 / f - truth.subjects().front().vergence_d) - f;
  return (extension_m - focused_m) * state.optics.aperture_diameter_m / (f + focused_m) /
         (scene.camera.pixel_um * 1e-6);
}

/// The scene with its walls elsewhere, and pictures of its own: no other run looks at it from there.
Result<std::shared_ptr<sim::Pictures>> Elsewhere(const sim::Scene& scene, std::uint64_t seed) {
  auto moved = std::make_shared<sim::Scene>(scene);
  const sim::LensSettings& lens = scene.lens;
  const double part = 0.1 + 0.8 * static_cast<double>(Mixed(seed) >> 11) * 0x1p-53;
  const double extension_m = 1e-3 * (lens.min_extension_mm + part * (lens.max_extension_mm - lens.min_extension_mm));
  const double f_m = 1e-3 * lens.min_focal_length_mm * (1.0 + lens.breathing * part);
  std::optional<double> by_d;
  for (sim::Surface& surface : moved->surfaces) {
    auto* plane = std::get_if<sim::PlaneShape>(&surface.shape);
    if (plane == nullptr || plane->ux_d != 0.0 || plane->uy_d != 0.0) {
      return Fail(Code::Unsupported, "subjects are drawn anew in scenes of walls alone");
    }
    if (!by_d) by_d = extension_m / (f_m * (f_m + extension_m)) - plane->u0_d;
    plane->u0_d = std::max(0.0, plane->u0_d + *by_d);
  }
  constexpr std::size_t kEnough = std::size_t{64} << 20;
  return sim::Pictures::Create(std::move(moved), kEnough);
}

/// What the rig is told of the lens, which is made late where that is wanted.
rig::RigConfig Believed(drivers::Device& device, const AutofocusRuns& wanted) {
  rig::RigConfig believed;
  believed.optics = device.optics;
  if (believed.optics) {
    believed.optics->min_f_number *= wanted.f_number_error;
    believed.optics->max_f_number *= wanted.f_number_error;
    believed.optics->focal_length_m *= wanted.focal_length_error;
    believed.optics->max_focal_length_m *= wanted.focal_length_error;
  }
  if (wanted.late > Duration::zero()) {
    device.lens = std::make_unique<LateLens>(std::move(device.lens), wanted.late);
    believed.axes[drivers::Axis::Focus].latency = wanted.late;
  }
  return believed;
}

Result<AutofocusRunResult> RunOnce(std::shared_ptr<sim::Pictures> pictures, const AutofocusRuns& wanted,
                                   std::uint64_t seed) {
  if (wanted.distance == SubjectDistance::DrawnAnew) {
    auto elsewhere = Elsewhere(pictures->scene(), Mixed(seed + 2));
    if (!elsewhere) return PassOn(elsewhere);
    pictures = *std::move(elsewhere);
  }
  const sim::Scene& scene = pictures->scene();
  AutofocusRunResult result;
  result.start_steps =
      wanted.start.value_or(static_cast<double>(Mixed(seed) % static_cast<std::uint64_t>(scene.lens.steps)));

  SteppedClock clock;
  sim::WorldOptions options{.seed = Mixed(seed + 1), .focus_start = Native{result.start_steps}, .pictures = pictures};
  auto world = sim::OpenWorld(std::shared_ptr<const sim::Scene>(pictures, &scene), clock, options);
  if (!world) return PassOn(world);
  rig::RigConfig believed = Believed(world->device, wanted);
  std::optional<Result<rig::AutofocusOutcome>> end;  // outlives the rig, which answers once more at its end
  double sway_d = 0.0;
  auto rig = rig::Rig::Create(std::move(believed), std::move(world->device), clock);
  if (!rig) return PassOn(rig);

  rig::AutofocusRequest request{.method = wanted.method};
  if (wanted.slope) request.slopes = [known = wanted.slope](const auto&, const auto&) { return known; };
  if (wanted.whole_frame) request.regions = {{0.0, 0.0, 1.0, 1.0}};
  const auto note = [&](const rig::AutofocusProgress& now) {
    result.blurs_px.push_back(BlurAt(*world->truth, scene, now.position.value));
  };
  const auto answered = [&](Result<rig::AutofocusOutcome> outcome) {
    if (end) return;
    end = std::move(outcome);
    sway_d = world->truth->Now().sway_d;  // the clock goes on to whatever the rig does next, and the subject with it
  };
  if (wanted.after == AfterAnswer::Track) request.track = answered;
  (*rig)->Autofocus(request, note, answered);
  while (!end && clock.Now() < Instant{wanted.patience}) clock.AdvanceTo((*rig)->Step(clock.Now()));
  if (!end) return Fail(Code::Internal, "an autofocus run did not end by itself");
  if (!*end) return PassOn(*end);

  const rig::AutofocusOutcome& outcome = **end;
  Note(outcome, result);
  Score(*world->truth, scene, sway_d, result);
  auto known = ForOneWhoKnows(pictures, options, *world->truth);
  if (!known) return PassOn(known);
  result.known = *known;
  ScoreSubject(outcome, *world->truth, result);
  return result;
}

}  // namespace

Result<std::vector<AutofocusRunResult>> RunAutofocus(const std::shared_ptr<sim::Pictures>& pictures,
                                                     const AutofocusRuns& wanted) {
  std::vector<AutofocusRunResult> results(static_cast<std::size_t>(wanted.runs));
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::optional<Error> error;
  const auto work = [&] {
    for (std::size_t i = next++; i < results.size(); i = next++) {
      auto result = RunOnce(pictures, wanted, Mixed(wanted.seed) + 2 * i);
      if (result) {
        results[i] = *std::move(result);
        continue;
      }
      const std::lock_guard lock(mutex);
      if (!error) error = result.error();
      next = results.size();
    }
  };
  {
    std::vector<std::jthread> threads;
    for (int i = 1; i < wanted.threads; ++i) threads.emplace_back(work);
    work();
  }
  if (error) return PassOn(*error);
  return results;
}

Result<std::optional<autofocus::KnownSlope>> LearnedFrom(const std::shared_ptr<sim::Pictures>& pictures,
                                                         AutofocusRuns like, int runs) {
  constexpr std::uint64_t kOther = 1000003;
  like.runs = runs;
  like.seed += kOther;
  auto taught = RunAutofocus(pictures, like);
  if (!taught) return PassOn(taught);
  autofocus::SlopeLearner learner;
  std::optional<double> last_focus;
  for (const AutofocusRunResult& run : *taught) {
    if (!run.log_slope) continue;
    learner.Add({*run.log_slope, run.uneven});
    last_focus = run.end_extension_m;
  }
  auto known = learner.Known();
  if (known) known->last_focus = last_focus;
  return known;
}

}  // namespace lensd::bench
