// Shares with their Wilson intervals and percentiles of many runs.
#include "bench/autofocus/summary.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace lensd::bench {
namespace {

constexpr double kTwoSided95 = 1.959963984540054;  // 97.5 % point of the normal distribution

double Milliseconds(Duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

std::vector<double> Values(const std::vector<AutofocusRunResult>& results,
                           const std::function<double(const AutofocusRunResult&)>& of) {
  std::vector<double> values;
  for (const AutofocusRunResult& result : results) values.push_back(of(result));
  return values;
}

/// Of the answers with a sigma, how many 95 % intervals hold the truth.
std::optional<double> ClaimHolds(const std::vector<AutofocusRunResult>& results) {
  double claims = 0, held = 0;
  for (const AutofocusRunResult& run : results) {
    if (!run.off_sigmas) continue;
    ++claims;
    held += std::abs(*run.off_sigmas) <= kTwoSided95;
  }
  return claims > 0 ? std::optional(held / claims) : std::nullopt;
}

}  // namespace

double WilsonLow(int hits, int runs) {
  const double n = runs;
  const double p = hits / n;
  const double middle = p + kTwoSided95 * kTwoSided95 / (2 * n);
  const double width = kTwoSided95 * std::sqrt(p * (1 - p) / n + kTwoSided95 * kTwoSided95 / (4 * n * n));
  return std::max(0.0, (middle - width) / (1 + kTwoSided95 * kTwoSided95 / n));
}

double Percentile(std::vector<double> values, double part) {
  const auto rank = static_cast<std::ptrdiff_t>(std::ceil(part * static_cast<double>(values.size()))) - 1;
  const auto at = values.begin() + std::clamp<std::ptrdiff_t>(rank, 0, std::ssize(values) - 1);
  std::ranges::nth_element(values, at);
  return *at;
}

double CpuMsPerFrame(const std::vector<AutofocusRunResult>& results) {
  double cpu_ms = 0.0, frames = 0.0;
  for (const AutofocusRunResult& run : results) {
    cpu_ms += Milliseconds(run.cpu);
    frames += run.frames;
  }
  return frames > 0 ? cpu_ms / frames : 0.0;
}

AutofocusSummary Summarise(const std::string& method, const std::vector<AutofocusRunResult>& results,
                           const FocusFloor* floor) {
  AutofocusSummary summary;
  summary.method = method;
  summary.runs = static_cast<int>(results.size());
  if (results.empty()) return summary;
  const auto share = [&](auto holds) {
    return static_cast<double>(std::ranges::count_if(results, holds)) / summary.runs;
  };
  summary.within = share([](const auto& run) { return run.within(); });
  summary.within_low = WilsonLow(static_cast<int>(std::lround(summary.within * summary.runs)), summary.runs);
  summary.false_focus = share([](const auto& run) { return run.false_focus(); });
  summary.refused = share([](const auto& run) { return !run.focused; });

  const auto frames = Values(results, [](const auto& run) { return run.frames; });
  const auto moves = Values(results, [](const auto& run) { return run.moves; });
  const auto waited = Values(results, [](const auto& run) { return Milliseconds(run.waited()); });
  const auto known = Values(results, [](const auto& run) { return Milliseconds(run.known); });
  const auto ratios = Values(results, [](const auto& run) {
    return run.known > Duration::zero() ? Milliseconds(run.waited()) / Milliseconds(run.known) : 0.0;
  });
  summary.frames_p50 = Percentile(frames, 0.50);
  summary.frames_p95 = Percentile(frames, 0.95);
  summary.moves_p50 = Percentile(moves, 0.50);
  summary.moves_p95 = Percentile(moves, 0.95);
  summary.waited_ms_p50 = Percentile(waited, 0.50);
  summary.waited_ms_p95 = Percentile(waited, 0.95);
  summary.known_ms_p50 = Percentile(known, 0.50);
  summary.times_known_p50 = Percentile(ratios, 0.50);

  summary.claim_holds = ClaimHolds(results);
  std::vector<double> errors;
  for (const AutofocusRunResult& run : results) {
    if (run.focused) errors.push_back(run.error_dof());
  }
  summary.cpu_ms_per_frame = CpuMsPerFrame(results);
  if (errors.empty()) return summary;
  summary.error_dof_p50 = Percentile(errors, 0.50);
  summary.error_dof_p95 = Percentile(errors, 0.95);
  summary.error_dof_max = Percentile(errors, 1.0);
  double error2 = 0.0, floor2 = 0.0;
  int counted = 0;
  for (const AutofocusRunResult& run : results) {
    if (floor == nullptr || !run.within()) continue;
    const double bound = std::hypot(floor->BoundPx(run.blurs_px), floor->quantisation_px());
    if (!std::isfinite(bound)) continue;
    // The bound is one on estimates: of the subject's place where the answer names it, else of where the lens stands.
    const double error = run.subject_px.value_or(run.error_px());
    error2 += error * error;
    floor2 += bound * bound;
    ++counted;
  }
  if (counted > 0) {
    summary.rms_error_px = std::sqrt(error2 / counted);
    summary.rms_floor_px = std::sqrt(floor2 / counted);
  }
  return summary;
}

}  // namespace lensd::bench
