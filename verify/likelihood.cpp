// With the weights held, the misfit minimised over the gain is a smooth function Q of the diameter; sums are known at
// the steps of the row and interpolated between by polynomials (they are even in the diameter). Its minimum is the
// likeliest diameter, whatever the weights; where Q exceeds it by z^2 lie the ends of the interval. Were the reference
// free of noise, Q would be a chi-square; with noise in both frames its slope scatters more than its curvature says,
// and Q is scaled by the ratio of the two (as for any likelihood that is not quite the true one).
#include "likelihood.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace lensd::verify {
namespace {

constexpr int kFirstRing = 2;       // block means are gone, and much of what lies beside them
constexpr double kTwoSided = 2.0;   // standard deviations: 95.4 %
constexpr double kOneSided = 2.33;  // 99 %
constexpr double kFinePx = 0.05;
constexpr int kPasses = 6;  // weights and fit follow from each other

// How far pictures keep to a disk's response, as a standard deviation of it. Toward the sampling limit part of a
// picture is folded, which no blur of the sampled reference repeats.
constexpr double kFolded = 0.42;  // cycles/px
constexpr double kModelError = 0.002, kFoldingError = 0.04;

/// Value at `place` (in steps) of an even function known at 0, 1, 2, ..., by six neighbours.
double Interpolated(const std::vector<double>& values, double place) {
  const int last = static_cast<int>(values.size()) - 1;
  const int first = std::min(static_cast<int>(std::floor(place)) - 2, last - 5);
  double sum = 0;
  for (int i = first; i < first + 6; ++i) {
    double weight = 1;
    for (int j = first; j < first + 6; ++j) {
      if (j != i) weight *= (place - j) / (i - j);
    }
    sum += weight * values[static_cast<std::size_t>(std::abs(i))];
  }
  return sum;
}

class Misfit {
 public:
  Misfit(const Spectra& spectra, const PartModel& model) {
    for (int ring = kFirstRing; ring < kRings; ++ring) picture_ += model.weight[ring] * spectra.picture[ring];
    for (const auto& step : spectra.steps) {
      double cross = 0, power = 0;
      for (int ring = kFirstRing; ring < kRings; ++ring) {
        cross += model.weight[ring] * step.cross[ring];
        power += model.weight[ring] * (step.power[ring] - step.noise[ring]);
      }
      cross_.push_back(cross);
      power_.push_back(power);
    }
  }
  double largest() const { return static_cast<double>(cross_.size() - 1) * kStepPx; }
  double GainAt(double diameter) const {
    const double power = Interpolated(power_, diameter / kStepPx);
    return power > 0 ? std::max(Interpolated(cross_, diameter / kStepPx) / power, 0.0) : 0.0;
  }
  double At(double diameter) const { return picture_ - GainAt(diameter) * Interpolated(cross_, diameter / kStepPx); }
  double BestDiameter() const {
    double best = 0, least = At(0);
    for (double d = kFinePx; d <= largest(); d += kFinePx) {
      if (const double here = At(d); here < least) {
        least = here;
        best = d;
      }
    }
    double low = std::max(best - kFinePx, 0.0), high = std::min(best + kFinePx, largest());
    for (int i = 0; i < 50; ++i) {
      const double a = low + (high - low) / 3, b = high - (high - low) / 3;
      (At(a) < At(b) ? high : low) = At(a) < At(b) ? b : a;
    }
    const double fine = 0.5 * (low + high);
    return At(fine) < At(best) ? fine : best;
  }
  enum class Towards { Small, Large };
  /// The outermost diameter on that side of `from` where the misfit is at most `level`.
  double EndFrom(double from, double level, Towards side) const {
    const bool upward = side == Towards::Large;
    double inside = from, outside = from;
    const double end = upward ? largest() : 0.0;
    for (double d = end; upward ? d > from : d < from; d += upward ? -kFinePx : kFinePx) {
      if (At(d) <= level) {
        inside = d;
        break;
      }
      outside = d;
    }
    if (inside == end) return end;
    if (outside == from) return from;
    for (int i = 0; i < 40; ++i) {
      const double middle = 0.5 * (inside + outside);
      (At(middle) <= level ? inside : outside) = middle;
    }
    return inside;
  }

 private:
  double picture_ = 0;
  std::vector<double> cross_, power_;
};

/// The step of the row nearest to a diameter.
const Spectra::Step& Nearest(const Spectra& spectra, double diameter) {
  const auto step = static_cast<std::size_t>(std::lround(diameter / kStepPx));
  return spectra.steps[std::min(step, spectra.steps.size() - 1)];
}

/// The part of a block that pixels fill, and so of its frequencies that are independent.
double IndependentOf(const Spectra& spectra, int ring) {
  return FrequenciesIn()[ring] * static_cast<double>(spectra.pixels) / (kBlock * kBlock);
}

/// The weights that follow from a fit and from what it leaves, which is the picture's noise.
void Reweigh(const Spectra& spectra, PartModel& model) {
  const Spectra::Step& step = Nearest(spectra, model.diameter_px);
  const auto pixels = static_cast<double>(spectra.pixels);
  const double g = model.gain;
  double left = 0, white = 0;
  for (int ring = kFirstRing; ring < kRings; ++ring) {
    const double w2 = model.weight[ring] * model.weight[ring];
    left += w2 * (spectra.picture[ring] - 2 * g * step.cross[ring] + g * g * (step.power[ring] - step.noise[ring]));
    white += w2 * pixels * FrequenciesIn()[ring];
  }
  const double variance = std::max(left / white, kQuantisation);
  for (int ring = kFirstRing; ring < kRings; ++ring) {
    const double all = pixels * FrequenciesIn()[ring] * variance + g * g * step.noise[ring];
    const double off = FrequencyOf(ring) < kFolded ? kModelError : kFoldingError;  // of all frequencies of a ring alike
    const double signal = std::max(spectra.steps.front().power[ring] - spectra.steps.front().noise[ring], 0.0);
    const double independent = IndependentOf(spectra, ring);
    model.weight[ring] = independent / (all + independent * g * g * off * off * signal);
  }
}

/// By what Q is to be multiplied for its excess over the minimum to be a chi-square: twice its expected curvature over
/// the variance of its slope, both along the square of the diameter with the gain following. 0: no texture at all.
double ChiSquarePerQ(const Spectra& spectra, const PartModel& model) {
  const double diameter = model.diameter_px;
  constexpr double kSmall = 0.02;  // px^2
  const double low = std::sqrt(std::max(diameter * diameter - kSmall, 0.0));
  const double high = std::sqrt(diameter * diameter + kSmall);
  const Spectra::Step& sharp = spectra.steps.front();
  Rings slope(kRings), kept(kRings);
  double both = 0, self = 0;
  for (int ring = kFirstRing; ring < kRings; ++ring) {
    const double f = FrequencyOf(ring), signal = sharp.power[ring] - sharp.noise[ring];
    const auto response = [&](double d) { return ResponseBetween(d, spectra.opening, f); };
    kept[ring] = response(diameter);
    slope[ring] = (response(high) - response(low)) / (high * high - low * low);
    both += model.weight[ring] * signal * slope[ring] * kept[ring];
    self += model.weight[ring] * signal * kept[ring] * kept[ring];
  }
  const double follows = self > 0 ? both / self : 0.0;
  const double g2 = model.gain * model.gain;
  double curvature = 0, scatter = 0, lean = 0;  // lean: of the slope, where the noise is misjudged by its whole
  for (int ring = kFirstRing; ring < kRings; ++ring) {
    const double w = model.weight[ring], turn = slope[ring] - follows * kept[ring];
    curvature += 2 * g2 * w * (sharp.power[ring] - sharp.noise[ring]) * turn * turn;
    const double shared = std::sqrt(g2) * turn * kept[ring] * sharp.noise[ring];
    lean += 2 * std::sqrt(g2) * w * shared;
    scatter += 4 * g2 * w * (sharp.power[ring] * turn * turn + w * shared * shared / IndependentOf(spectra, ring));
  }
  scatter += lean * lean * spectra.noise_error * spectra.noise_error;
  return curvature > 0 ? std::min(2 * curvature / scatter, 1.0) : 0.0;
}

}  // namespace

DiameterFit FitDiameter(const Spectra& spectra) {
  DiameterFit fit;
  fit.pixels = spectra.pixels;
  PartModel& model = fit.model;
  std::fill(model.weight.begin() + kFirstRing, model.weight.end(), 1.0);
  const auto refit = [&](const Misfit& misfit) {
    model.diameter_px = misfit.BestDiameter();
    model.gain = misfit.GainAt(model.diameter_px);
  };
  for (int pass = 0; pass < kPasses; ++pass) {
    refit(Misfit(spectra, model));
    Reweigh(spectra, model);
  }
  const Misfit misfit(spectra, model);
  refit(misfit);
  const double least = misfit.At(model.diameter_px);
  const double scale = ChiSquarePerQ(spectra, model);
  const auto level = [&](double z) { return scale > 0 ? least + z * z / scale : INFINITY; };
  if (misfit.At(0) > level(kTwoSided))
    fit.low_px = misfit.EndFrom(model.diameter_px, level(kTwoSided), Misfit::Towards::Small);
  fit.high_px =
      misfit.EndFrom(model.diameter_px, level(fit.low_px > 0 ? kTwoSided : kOneSided), Misfit::Towards::Large);
  fit.open = fit.high_px >= misfit.largest();
  return fit;
}

}  // namespace lensd::verify
