// The truth is sampled over f-number, extension, depth and the sign of the calibration's error, by formulas written
// here again: blur of the thin lens, the Airy disk at the working f-number, and a pupil factor's divisor.
#include "bench/plan/needs.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <random>

#include "optics/model_ladder.h"
#include "optics/planner.h"

namespace lensd::bench {
namespace {

using optics::PlanRequest;
using optics::Rung;

constexpr double kWavelength = 550e-9, kAiry = 2.44;
constexpr int kSamples = 7;  // along each of the ranges, both ends among them

struct Span {
  double low, high;
};

/// From what a kind of plan is drawn. Lengths in metres.
struct PlanKind {
  const char* name;
  Span f, n, distance, limit;
  double pixel;
  Span pupil, calibration_error;
};
constexpr PlanKind kKinds[] = {
    {"a pinhole and coarse pixels", {2e-3, 4e-3}, {16, 24}, {1, 20}, {50e-6, 100e-6}, 200e-6, {1, 1}, {0, 0}},
    {"coarse pixels, wide open", {4e-3, 12e-3}, {1.4, 2}, {0.5, 10}, {20e-6, 60e-6}, 20e-6, {1, 1}, {0, 0}},
    {"portrait", {35e-3, 85e-3}, {1.4, 4}, {1, 4}, {20e-6, 60e-6}, 4e-6, {1, 1}, {0, 0}},
    {"landscape, closed down", {18e-3, 50e-3}, {8, 22}, {2, 50}, {10e-6, 30e-6}, 3.45e-6, {1, 1}, {0, 0}},
    {"close-up, pupils unlike", {35e-3, 100e-3}, {2.8, 11}, {0.4, 1}, {5e-6, 20e-6}, 3.45e-6, {0.7, 1.4}, {0, 0}},
    {"telephoto, measured", {100e-3, 300e-3}, {2.8, 8}, {5, 50}, {5e-6, 20e-6}, 3.45e-6, {0.8, 1.2}, {1e-6, 50e-6}}};

double DrawnFrom(std::mt19937_64& random, Span span) {
  return span.low == span.high ? span.low
                               : std::exp(std::uniform_real_distribution(std::log(std::max(span.low, 1e-12)),
                                                                         std::log(span.high))(random));
}

PlanRequest DrawRequest(std::mt19937_64& random, const PlanKind& kind) {
  PlanRequest request;
  const double f = DrawnFrom(random, kind.f), n = DrawnFrom(random, kind.n);
  const double far = 1 / DrawnFrom(random, kind.distance),
               near = far * std::uniform_real_distribution(1.01, 1.3)(random);
  request.focal_length = f;
  request.f_numbers = {n, n * 1.4};
  const auto extension = [&](double u) { return f * f * u / (1 - f * u); };
  request.extensions = {extension(0.9 * far), extension(1.1 * near)};
  request.wavelength = kWavelength;
  request.pupil_factor = DrawnFrom(random, kind.pupil);
  request.calibration_error = {DrawnFrom(random, kind.calibration_error)};
  request.pixel = Metres{kind.pixel};
  optics::BlurLimit limit{.name = "subject",
                          .kind = optics::LimitKind::Sharp,
                          .depths = {},
                          .limit = DrawnFrom(random, kind.limit),
                          .side = optics::Side::Either};
  limit.depths = {{optics::PlanDepth::Vergence(far), optics::PlanDepth::Vergence(near)}};
  request.limits.push_back(std::move(limit));
  return request;
}

/// Blur of a rung at one setting and depth.
double BlurOf(Rung rung, const PlanRequest& r, double n, double e, double u, double calibration) {
  if (rung == Rung::Pinhole) return 0.0;
  const double f = r.focal_length.value;
  const double thin = (e - f * (f + e) * u) / n;
  if (rung == Rung::Thin) return std::abs(thin);
  if (rung == Rung::Diffraction) return std::hypot(thin, kAiry * kWavelength * n * (1 + e / f));
  const double p = r.pupil_factor.value, g = 1 + f * u * (1 / p - 1);
  return std::hypot((thin + calibration * (1 - f * u) / n) / g,
                    kAiry * kWavelength * n * (1 + (e + calibration) / (p * f)));
}

double TrueError(Rung rung, const PlanRequest& r) {
  const auto& depths = r.limits.front().depths.front();
  const auto at = [](double low, double high, int i) { return low + (high - low) * i / (kSamples - 1.0); };
  double worst = 0.0;
  for (int i = 0; i < kSamples * kSamples * kSamples; ++i) {
    const double n = at(r.f_numbers.low.value, r.f_numbers.high.value, i % kSamples);
    const double e = at(r.extensions.low.value, r.extensions.high.value, i / kSamples % kSamples);
    const double u = at(depths.one_end.vergence().value, depths.other_end.vergence().value, i / kSamples / kSamples);
    for (const double sign : {-1.0, 1.0}) {
      const double full = BlurOf(Rung::Calibrated, r, n, e, u, sign * r.calibration_error.value);
      worst = std::max(worst, std::abs(full - BlurOf(rung, r, n, e, u, sign * r.calibration_error.value)));
    }
  }
  return worst;
}

/// The same question with only what the rung knows.
PlanRequest AskedOf(Rung rung, PlanRequest request) {
  if (rung < Rung::Calibrated) {
    request.pupil_factor = 1.0;
    request.calibration_error = Metres{0.0};
  }
  if (rung < Rung::Diffraction) request.wavelength.reset();
  return request;
}

/// Microseconds of one plan.
double TimeOf(const PlanRequest& request) {
  constexpr int kRepeats = 200;
  const auto began = std::chrono::steady_clock::now();
  for (int i = 0; i < kRepeats; ++i) (void)optics::Plan(request);
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - began).count() / kRepeats;
}

double MiddleOf(std::vector<double> values) {
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
  return values[values.size() / 2];
}

ModelNeed NeedOf(const PlanKind& kind, int problems, std::mt19937_64& random) {
  ModelNeed need{.plan = kind.name, .problems = problems, .models = {}};
  std::map<Rung, int> chosen;
  std::vector<double> errors, bounds, tolerances, times, heaviest;
  for (int i = 0; i < problems; ++i) {
    const PlanRequest request = DrawRequest(random, kind);
    const double tolerance =
        optics::DefaultModelTolerance(Metres{request.limits.front().limit.value}, request.pixel).value;
    const auto plan = optics::Plan(request);
    if (!plan || plan->limits.empty()) continue;  // nothing was asked of a model
    const auto [rung, bound] = optics::ModelFor(request, plan->limits);
    ++chosen[rung];
    errors.push_back(1e6 * TrueError(rung, request));
    bounds.push_back(1e6 * bound.value);
    tolerances.push_back(1e6 * tolerance);
    constexpr double kRounding = 1e-9;  // micrometres
    need.beyond += errors.back() > std::min(tolerances.back(), bounds.back()) + kRounding ? 1 : 0;
    if (rung != Rung::Pinhole) {
      const auto before = static_cast<Rung>(static_cast<int>(rung) - 1);
      need.simpler += TrueError(before, request) <= tolerance ? 1 : 0;
    }
    times.push_back(TimeOf(AskedOf(rung, request)));
    heaviest.push_back(TimeOf(request));
  }
  for (const auto& [rung, count] : chosen) {
    need.models +=
        (need.models.empty() ? "" : ", ") + std::string(optics::RungName(rung)) + " " + std::to_string(count);
  }
  need.error_um = MiddleOf(errors);
  need.bound_um = MiddleOf(bounds);
  need.tolerance_um = MiddleOf(tolerances);
  need.chosen_us = MiddleOf(times);
  need.heaviest_us = MiddleOf(heaviest);
  return need;
}

}  // namespace

std::vector<ModelNeed> MeasureNeeds(int problems, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<ModelNeed> needs;
  for (const PlanKind& kind : kKinds) needs.push_back(NeedOf(kind, problems, random));
  return needs;
}

}  // namespace lensd::bench
