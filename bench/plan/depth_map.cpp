// How near to the speed of memory a depth map is planned.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <functional>
#include <numeric>
#include <random>

#include "bench/plan/measure.h"
#include "optics/depth_extremes.h"
#include "optics/planner.h"

namespace lensd::bench {
namespace {

using Clock = std::chrono::steady_clock;
using Samples = std::vector<std::uint16_t>;

/// Reads every sample once, eight bytes at a time.
std::uint64_t ReadOnce(const Samples& samples) {
  constexpr std::size_t kWords = 8, kSamples = kWords * sizeof(std::uint64_t) / sizeof(samples[0]);
  std::array<std::uint64_t, kWords> sums{}, words{};
  for (std::size_t i = 0; i + kSamples <= samples.size(); i += kSamples) {
    std::memcpy(words.data(), samples.data() + i, sizeof words);
    for (std::size_t k = 0; k < kWords; ++k) sums[k] ^= words[k];
  }
  return std::accumulate(sums.begin(), sums.end(), std::uint64_t{0});
}

/// The smallest f-number that keeps the class sharp; depths in millimetres.
std::uint64_t PlanClass(const Samples& depths, const Samples& classes, std::uint16_t wanted) {
  const optics::DepthExtremes ends = optics::ExtremesOfClass(depths, classes, wanted);
  optics::PlanRequest request;
  request.focal_length = 0.05;
  request.f_numbers = {1.4, 22.0};
  request.extensions = {0.0, 0.008};
  request.limits = {
      {.name = "class",
       .kind = optics::LimitKind::Sharp,
       .depths = {{optics::PlanDepth::Distance(ends.nearest / 1e3), optics::PlanDepth::Distance(ends.farthest / 1e3)}},
       .limit = 500e-6}};
  const auto answer = optics::Plan(request);
  return answer && answer->feasible ? 1 : 0;
}

double Microseconds(const std::function<std::uint64_t()>& work) {
  const auto start = Clock::now();
  work();
  return std::chrono::duration<double, std::micro>(Clock::now() - start).count();
}

}  // namespace

std::vector<Measured> MeasureDepthMap(std::size_t pixels, std::uint64_t seed, int rounds) {
  constexpr int kClass = 2, kClasses = 3, kRepeats = 10;
  std::mt19937_64 random(seed);
  Samples depths(pixels), classes(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    depths[i] = static_cast<std::uint16_t>(random() % 9000 + 500);
    classes[i] = static_cast<std::uint16_t>(random() % kClasses);
  }
  std::vector<double> ours, floor, ratio;
  for (int round = 0; round < rounds * kRepeats; ++round) {
    ours.push_back(Microseconds([&] { return PlanClass(depths, classes, kClass); }));
    floor.push_back(Microseconds([&] { return ReadOnce(depths) + ReadOnce(classes); }));
    ratio.push_back(floor.back() / ours.back());
  }
  const std::string set = std::to_string(pixels) + " pixels, one class of a depth map";
  return {{.set = set,
           .method = "lensd",
           .limits = pixels,
           .problems = 1,
           .time_us = Median(ours),
           .time_to_ours = 1.0,
           .plans = false},
          {.set = set,
           .method = "reading the numbers once",
           .limits = pixels,
           .problems = 1,
           .time_us = Median(floor),
           .time_to_ours = Median(ratio),
           .plans = false}};
}

}  // namespace lensd::bench
