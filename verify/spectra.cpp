// The reference is blurred as a whole, so that every pixel gets the light of its true neighbours; only then is a part
// cut out of it and out of the picture alike. What cutting does to noise that the blur has made alike from pixel to
// pixel is worked out exactly: its covariance times the autocorrelation of the part's shape.
#include "spectra.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

namespace lensd::verify {
namespace {

using Values = std::vector<std::complex<float>>;

constexpr int kLags = 2 * kBlock;    // of an autocorrelation, both signs
constexpr int kFewestInBlock = 128;  // pixels of a part: fewer tell little but their mean

double Signed(int index, int size) {
  return index <= size / 2 ? index : index - size;
}

struct Frequencies {
  std::array<int, kBlock * kBlock> ring{};
  std::vector<double> in_ring = std::vector<double>(kRings);

  Frequencies() {
    for (int i = 0; i < kBlock * kBlock; ++i) {
      const double fx = Signed(i % kBlock, kBlock), fy = Signed(i / kBlock, kBlock);
      ring[i] = static_cast<int>(std::lround(std::hypot(fx, fy)));
      in_ring[ring[i]] += 1;
    }
  }
};
const Frequencies kFrequencies;

Values SpectrumOf(const Plane& plane, std::span<const int> in_frame, std::span<const int> in_block) {
  double sum = 0;
  for (const int at : in_frame) sum += plane.values[at];
  const auto mean = static_cast<float>(sum / static_cast<double>(in_frame.size()));
  Values cut(kBlock * kBlock);
  for (std::size_t i = 0; i < in_frame.size(); ++i) cut[in_block[i]] = plane.values[in_frame[i]] - mean;
  return Transformed(cut, kBlock, kBlock, Transform::Forward);
}

// Covariance of white noise of variance 1 after the blur, lag by lag around zero.
std::vector<float> CovarianceAfter(double diameter_px, double opening) {
  Values power(kLags * kLags);
  for (int i = 0; i < kLags * kLags; ++i) {
    const double frequency = std::hypot(Signed(i % kLags, kLags), Signed(i / kLags, kLags)) / kLags;
    const double kept = ResponseBetween(diameter_px, opening, frequency);
    power[i] = static_cast<float>(kept * kept / (kLags * kLags));
  }
  const Values lags = Transformed(power, kLags, kLags, Transform::Inverse);
  std::vector<float> covariance(lags.size());
  std::ranges::transform(lags, covariance.begin(), [](std::complex<float> value) { return value.real(); });
  return covariance;
}

void AddNoise(const std::vector<float>& shape, const std::vector<float>& covariance, Rings& noise) {
  Values folded(kBlock * kBlock);
  for (int i = 0; i < kLags * kLags; ++i) {
    folded[(i / kLags % kBlock) * kBlock + i % kLags % kBlock] += shape[i] * covariance[i];
  }
  const Values power = Transformed(folded, kBlock, kBlock, Transform::Forward);
  for (int i = 0; i < kBlock * kBlock; ++i) noise[kFrequencies.ring[i]] += power[i].real();
}

void AddStep(const Values& picture, const Values& blurred, Spectra::Step& step) {
  for (int i = 0; i < kBlock * kBlock; ++i) {
    const int ring = kFrequencies.ring[i];
    step.cross[ring] += (picture[i] * std::conj(blurred[i])).real();
    step.power[ring] += std::norm(blurred[i]);
  }
}

enum class SlopeAlong { X, Y };

/// By the six nearest neighbours.
Plane SlopeOf(const Plane& plane, SlopeAlong along) {
  Plane slope{plane.width, plane.height, std::vector<float>(plane.values.size())};
  const bool along_x = along == SlopeAlong::X;
  const int size = along_x ? plane.width : plane.height;
  const int stride = along_x ? 1 : plane.width;
  for (int y = 0; y < plane.height; ++y) {
    for (int x = 0; x < plane.width; ++x) {
      const int at = y * plane.width + x, place = along_x ? x : y;
      if (place < 3 || place >= size - 3) continue;
      const auto difference = [&](int away) {
        return plane.values[at + away * stride] - plane.values[at - away * stride];
      };
      slope.values[at] = 0.75f * difference(1) - 0.15f * difference(2) + difference(3) / 60.0f;
    }
  }
  return slope;
}

/// Normal equations of a displacement.
struct NormalEquations {
  double x = 0, y = 0, xx = 0, xy = 0, yy = 0;

  Displacement Solved() const {
    const double det = xx * yy - xy * xy;
    if (!(det > 1e-9 * xx * yy)) return {};
    return {{(yy * x - xy * y) / det, (xx * y - xy * x) / det}, det / std::max(xx, yy)};
  }
};

}  // namespace

// The pixels of one part that lie in one block.
struct SpectraTaker::Patch {
  int part = 0;
  std::vector<int> in_frame;  // indices
  std::vector<int> in_block;
  Values picture;
};

const std::vector<double>& FrequenciesIn() {
  return kFrequencies.in_ring;
}

std::vector<SpectraTaker::Patch> SpectraTaker::Patches() const {
  const Plane& picture = frames_.picture;
  std::vector<Patch> patches;
  for (int top = 0; top < picture.height; top += kBlock) {
    for (int left = 0; left < picture.width; left += kBlock) {
      std::vector<Patch> here(static_cast<std::size_t>(frames_.parts));
      for (int y = top; y < std::min(top + kBlock, picture.height); ++y) {
        for (int x = left; x < std::min(left + kBlock, picture.width); ++x) {
          const int at = y * picture.width + x;
          if (frames_.part[at] < 0) continue;
          here[frames_.part[at]].in_frame.push_back(at);
          here[frames_.part[at]].in_block.push_back((y - top) * kBlock + x - left);
        }
      }
      for (int part = 0; part < frames_.parts; ++part) {
        if (here[part].in_frame.size() < kFewestInBlock) continue;
        here[part].part = part;
        here[part].picture = SpectrumOf(picture, here[part].in_frame, here[part].in_block);
        patches.push_back(std::move(here[part]));
      }
    }
  }
  return patches;
}

// A patch's autocorrelation, lag by lag around zero, times the mean variance of the reference's noise in it.
std::vector<float> SpectraTaker::ShapeOf(const Patch& patch) const {
  Values mask(kLags * kLags);
  double variance = 0;
  for (std::size_t i = 0; i < patch.in_block.size(); ++i) {
    mask[(patch.in_block[i] / kBlock) * kLags + patch.in_block[i] % kBlock] = 1.0f;
    variance += frames_.reference_variance[patch.in_frame[i]];
  }
  variance /= static_cast<double>(patch.in_block.size());
  Values spectrum = Transformed(mask, kLags, kLags, Transform::Forward);
  for (auto& value : spectrum) value = std::norm(value);
  std::vector<float> shape;
  const auto scale = static_cast<float>(variance / (kLags * kLags));
  for (const auto& lag : Transformed(spectrum, kLags, kLags, Transform::Inverse)) shape.push_back(lag.real() * scale);
  return shape;
}

SpectraTaker::SpectraTaker(DividedFrames frames, int steps)
    : frames_(std::move(frames)),
      blur_(frames_.reference, frames_.reference_opening, static_cast<int>(std::ceil(steps * kStepPx)) + 2),
      patches_(Patches()),
      at_rest_(static_cast<std::size_t>(frames_.parts)) {
  std::vector<std::vector<float>> shapes(at_rest_.size(), std::vector<float>(kLags * kLags));
  for (Spectra& part : at_rest_) {
    part.steps.resize(static_cast<std::size_t>(steps));
    part.noise_error = frames_.reference_variance_error;
    part.opening = frames_.reference_opening;
  }
  for (const Patch& patch : patches_) {
    Spectra& part = at_rest_[patch.part];
    part.pixels += static_cast<long>(patch.in_frame.size());
    for (int i = 0; i < kBlock * kBlock; ++i) part.picture[kFrequencies.ring[i]] += std::norm(patch.picture[i]);
    std::ranges::transform(shapes[patch.part], ShapeOf(patch), shapes[patch.part].begin(), std::plus());
  }
  for (int step = 0; step < steps; ++step) {
    const std::vector<float> covariance = CovarianceAfter(step * kStepPx, frames_.reference_opening);
    for (std::size_t part = 0; part < at_rest_.size(); ++part) {
      if (at_rest_[part].pixels > 0) AddNoise(shapes[part], covariance, at_rest_[part].steps[step].noise);
    }
  }
}

SpectraTaker::~SpectraTaker() = default;

std::vector<Spectra> SpectraTaker::Take(int steps, Shift shift) const {
  std::vector<Spectra> spectra = at_rest_;
  for (int step = 0; step < steps; ++step) {
    const Plane blurred = blur_.Blurred(step * kStepPx, shift);
    for (const Patch& patch : patches_) {
      AddStep(patch.picture, SpectrumOf(blurred, patch.in_frame, patch.in_block), spectra[patch.part].steps[step]);
    }
  }
  return spectra;
}

Displacement SpectraTaker::DisplacementOf(const std::vector<PartModel>& models, Shift shift) const {
  NormalEquations sums;
  for (std::size_t part = 0; part < models.size(); ++part) {
    const PartModel& model = models[part];
    if (!(model.gain > 0)) continue;
    const Plane blurred = blur_.Blurred(model.diameter_px, shift);
    const Plane slope_x = SlopeOf(blurred, SlopeAlong::X), slope_y = SlopeOf(blurred, SlopeAlong::Y);
    const auto gain = static_cast<float>(model.gain);
    for (const Patch& patch : patches_) {
      if (patch.part != static_cast<int>(part)) continue;
      const auto cut = [&](const Plane& plane) { return SpectrumOf(plane, patch.in_frame, patch.in_block); };
      const Values here = cut(blurred), x = cut(slope_x), y = cut(slope_y);
      for (int i = 0; i < kBlock * kBlock; ++i) {
        const double w = model.weight[kFrequencies.ring[i]];
        const std::complex<float> misfit = patch.picture[i] - gain * here[i];
        sums.x -= w * gain * (std::conj(misfit) * x[i]).real();
        sums.y -= w * gain * (std::conj(misfit) * y[i]).real();
        sums.xx += w * gain * gain * std::norm(x[i]);
        sums.yy += w * gain * gain * std::norm(y[i]);
        sums.xy += w * gain * gain * (std::conj(x[i]) * y[i]).real();
      }
    }
  }
  return sums.Solved();
}

std::vector<Spectra> SpectraTaker::Take(Shift shift) const {
  return Take(at_rest_.empty() ? 0 : static_cast<int>(at_rest_.front().steps.size()), shift);
}

}  // namespace lensd::verify
