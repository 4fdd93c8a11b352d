// The sums over rings for one to four frames, compiled for each number of frames: an estimate evaluates them at many
// places.
#include "defocus/likelihood.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "defocus/disk_response.h"
#include "defocus/small_matrix.h"

namespace lensd::autofocus::defocus {
namespace {

constexpr double kModelError = 0.1;    // of the response, independent between frames
constexpr double kModelFloor = 0.02;   // of the response's envelope: real disks have no perfect zeros
constexpr double kDisplacement = 0.2;  // px: of one frame against another
constexpr double kSmear = 0.8;         // bins
constexpr double kSmearWeights[] = {0.32, 0.36, 0.32};
constexpr int kSteps = 2;
constexpr double kLongestStep = 1.5;  // of log power

/// A ring while its texture is being fitted.
struct State {
  Matrix gains{};
  double log_power = 0.0;
  double wanted = 0.0;       ///< log power that the data alone ask for
  double information = 0.0;  ///< about it
};

double Envelope(double turns) {
  const double x = std::numbers::pi * std::abs(turns);
  return x < 1.4 ? 1.0 : 8.0 / (std::numbers::pi * x * x * x);
}

template <int n>
Matrix Covariance(const State& state, const std::array<double, kMostFrames>& noise) {
  Matrix covariance{};
  const double power = std::exp(state.log_power);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) covariance[Slot(i, j)] = power * state.gains[Slot(i, j)];
    covariance[Slot(i, i)] += noise[static_cast<std::size_t>(i)];
  }
  return covariance;
}

/// Where to start: the power whose S G is nearest to what is left without noise.
template <int n>
double FirstLogPower(const State& state, const Ring& ring, const std::array<double, kMostFrames>& noise) {
  double product = 0.0;
  double square = 0.0;
  double trace = 0.0;
  double floor = 0.0;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const double g = state.gains[Slot(i, j)];
      product += g * (ring.power[Slot(i, j)] - (i == j ? noise[static_cast<std::size_t>(i)] : 0.0));
      square += g * g;
    }
    trace += state.gains[Slot(i, i)];
    floor += noise[static_cast<std::size_t>(i)];
  }
  return std::log(std::max(product / square, 0.03 * floor / trace));
}

template <int n>
void Score(State& state, const Ring& ring, const std::array<double, kMostFrames>& noise) {
  const Inverse<n> inverse = Invert<n>(Covariance<n>(state, noise));
  const Matrix gain = Product<n>(inverse.inverse, state.gains);
  const double power = std::exp(state.log_power);
  const double excess = TraceOfProduct<n>(gain, Product<n>(inverse.inverse, ring.power)) - Trace<n>(gain);
  state.information = ring.count * power * power * TraceOfProduct<n>(gain, gain);
  const double step = ring.count * power * excess / std::max(state.information, 1e-9);
  state.wanted = state.log_power + std::clamp(step, -kLongestStep, kLongestStep);
}

}  // namespace

Likelihood::Likelihood(const RingStack& stack, std::span<const double> positions) : stack_(stack) {
  std::ranges::copy(positions, positions_.begin());
  for (const Ring& ring : stack.rings) {
    const double phase = 2.0 * std::numbers::pi * ring.frequency * kDisplacement;
    places_.push_back(TexturePrior::PlaceOf(ring.frequency));
    coherence_.push_back(std::exp(-0.5 * phase * phase));
    count_ += ring.count;
  }
}

template <int n>
Matrix Likelihood::Gains(const Ring& ring, std::size_t index, const std::array<double, kMostFrames>& blur) const {
  Matrix gains{};
  double total = 0.0;
  for (int q = 0; q < 3; ++q) {
    const double f = std::max(ring.frequency + (q - 1) * kSmear * ring.spread, 0.25 * ring.frequency);
    const double relative = ring.frequency / f;
    const double weight = kSmearWeights[q] * relative * relative;
    double response[n];
    for (int i = 0; i < n; ++i) response[i] = DiskResponse(blur[static_cast<std::size_t>(i)] * f);
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j <= i; ++j) gains[Slot(i, j)] += weight * response[i] * response[j];
    }
    total += weight;
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < i; ++j) gains[Slot(j, i)] = gains[Slot(i, j)] *= coherence_[index] / total;
    const double envelope = Envelope(blur[static_cast<std::size_t>(i)] * ring.frequency);
    gains[Slot(i, i)] = gains[Slot(i, i)] / total * (1.0 + kModelError * kModelError) + kModelFloor * envelope;
  }
  return gains;
}

template <int n>
Fit Likelihood::FitOf(double focus, double slope, double uneven) const {
  std::array<double, kMostFrames> blur{};
  for (std::size_t i = 0; i < n; ++i) {
    const double off = positions_[i] - focus;
    blur[i] = slope * off * (uneven == 0.0 ? 1.0 : std::exp(off > 0 ? uneven : -uneven));
  }
  static thread_local std::vector<State> states;
  states.resize(stack_.rings.size());
  for (std::size_t r = 0; r < states.size(); ++r) {
    states[r].gains = Gains<n>(stack_.rings[r], r, blur);
    states[r].log_power = FirstLogPower<n>(states[r], stack_.rings[r], stack_.noise);
  }
  constexpr double kVariance = TexturePrior::kScatter * TexturePrior::kScatter;
  TexturePrior prior;
  for (int step = 0; step < kSteps; ++step) {
    prior = {};
    for (std::size_t r = 0; r < states.size(); ++r) {
      Score<n>(states[r], stack_.rings[r], stack_.noise);
      prior.Add(places_[r], states[r].wanted, 1.0 / (1.0 / std::max(states[r].information, 1e-9) + kVariance));
    }
    prior.Fit();
    for (std::size_t r = 0; r < states.size(); ++r) {
      State& state = states[r];
      const double expected = prior.At(places_[r]);
      state.log_power =
          (state.wanted * state.information + expected / kVariance) / (state.information + 1.0 / kVariance);
    }
  }
  Fit fit;
  fit.log_prior = prior.LogDensity();
  for (std::size_t r = 0; r < states.size(); ++r) {
    const State& state = states[r];
    const Ring& ring = stack_.rings[r];
    const Inverse<n> inverse = Invert<n>(Covariance<n>(state, stack_.noise));
    const double trace = TraceOfProduct<n>(inverse.inverse, ring.power);
    const double off = state.log_power - prior.At(places_[r]);
    fit.log_likelihood -= ring.count * (inverse.log_determinant + trace);
    fit.log_prior -= 0.5 * (off * off / kVariance + std::log1p(kVariance * state.information));
    fit.excess += ring.count * (trace / n - 1.0) / count_;
  }
  return fit;
}

Fit Likelihood::At(double focus, double slope, double uneven) const {
  switch (stack_.frames) {
    case 1:
      return FitOf<1>(focus, slope, uneven);
    case 2:
      return FitOf<2>(focus, slope, uneven);
    case 3:
      return FitOf<3>(focus, slope, uneven);
    default:
      return FitOf<4>(focus, slope, uneven);
  }
}

}  // namespace lensd::autofocus::defocus
