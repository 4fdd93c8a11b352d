// What may give a curve a top where the window itself has none: parts at several depths, the blur of what lies beside
// the window, and light that was cut off where the window is sharpest.
#include <algorithm>
#include <cmath>

#include "autofocus/search/sharpness_curve.h"

namespace lensd::autofocus {
namespace {

constexpr double kDoubtSigmas = 4.0;
constexpr double kContradictsPx = 4.0;  ///< of blur: what is sharper so far away contradicts an answer
constexpr double kMuchSharper = 1.3;
constexpr double kLessLight = 0.998;
constexpr double kSharperBeside = 2.0;  ///< what lies beside the window, where its focus is

/// Cutting light off takes energy away and adds none. So where the whole window is sharper in a frame in which more of
/// it is cut off, or more light is lost by that, what is left of it is sharpest in the wrong place.
bool ClippedPartsContradict(const std::vector<FrameEnergy>& frames, double apart) {
  const FrameEnergy& last = frames.back();
  return std::ranges::any_of(frames, [&](const FrameEnergy& frame) {
    const bool more = frame.clipped > last.clipped || frame.all_light < kLessLight * last.all_light;
    if (!more || std::abs(frame.whole.position - last.whole.position) < apart) return false;
    const double clear = kDoubtSigmas * std::hypot(frame.whole.sigma, last.whole.sigma);
    return frame.whole.value > kMuchSharper * last.whole.value + clear;
  });
}

/// Of what lies so near to the window that so much blur, in px, brings its light into it; less noise.
Band Reaching(const FrameEnergy& frame, double blur) {
  Band sum;
  for (std::size_t i = 0; i < kBandEndsPx.size(); ++i) {
    if (i > 0 && kBandEndsPx[i - 1] > 0.5 * blur + 1.0) break;
    sum.energy += frame.beside[i].energy - frame.noise * frame.beside[i].pixels;
    sum.pixels += frame.beside[i].pixels;
  }
  return sum;
}

/// Blur spreads the light step of an edge over its width: of the energy that an edge beside the window has in focus,
/// the window gets no more than that over the width in pixels.
bool EntersFromOutside(const std::vector<FrameEnergy>& frames, double px) {
  const FrameEnergy& last = frames.back();
  return std::ranges::any_of(frames, [&](const FrameEnergy& frame) {
    const double blur = std::abs(frame.whole.position - last.whole.position) / px;
    if (blur < kContradictsPx) return false;
    const double lighter = last.light / std::max(frame.light, 1e-9);
    const Band there = Reaching(frame, blur);
    const double energy = lighter * lighter * there.energy;
    const double clear = kDoubtSigmas * frame.noise * std::sqrt(there.pixels);
    return energy > kSharperBeside * Reaching(last, blur).energy + clear && energy > blur * std::max(last.left, 0.0);
  });
}

}  // namespace

std::optional<Why> DoubtOfLast(const Setup& setup, const SharpnessCurve& curve) {
  constexpr double kBlindPixels = 170.0;  ///< of blur over the range, where the optics are not known
  const std::vector<FrameEnergy> frames = curve.Energies();
  if (frames.empty()) return std::nullopt;
  const double px = setup.blur_px ? NearPx(setup) : (setup.highest - setup.lowest) / kBlindPixels;
  if (curve.LeavesOut() && ClippedPartsContradict(frames, std::max(kContradictsPx * px, 1.1 * setup.resolution))) {
    return Why{Cause::TooBright,
               "parts of the region are too bright for the sensor, and are sharper elsewhere than what is left of it"};
  }
  if (EntersFromOutside(frames, px)) {
    return Why{Cause::NoTexture,
               "what changes with focus is the blur of something beside the region, which has too little texture of "
               "its own: move the region onto it, or choose a larger one"};
  }
  return std::nullopt;
}

std::vector<double> SeveralDepths(const Setup& setup, const std::vector<PartPeak>& peaks, double best) {
  constexpr double kFarPx = 4.5;    // of blur: just inside the frames beside an answer
  constexpr double kApartPx = 4.0;  // depths nearer to each other are named as one
  constexpr double kMost = 0.3;     // of the parts' weight
  if (!setup.blur_px) return {};
  const double far = std::max(kFarPx * *setup.blur_px, 1.6 * setup.resolution);
  double elsewhere = 0.0, all = 0.0;
  int count = 0;
  for (const PartPeak& peak : peaks) {
    all += peak.weight;
    if (std::abs(peak.position - best) <= far) continue;
    elsewhere += peak.weight;
    ++count;
  }
  if (count < 2 || elsewhere <= kMost * all) return {};
  const double apart = std::max(kApartPx * *setup.blur_px, 1.1 * setup.resolution);
  std::vector<double> depths;
  std::size_t begin = 0;
  for (std::size_t i = 1; i <= peaks.size(); ++i) {
    if (i < peaks.size() && peaks[i].position - peaks[i - 1].position <= apart) continue;
    depths.push_back(peaks[(begin + i - 1) / 2].position);
    begin = i;
  }
  // A region that recedes evenly has no gaps: then its ends are named.
  if (depths.size() < 2) depths = {peaks.front().position, peaks.back().position};
  return depths;
}

}  // namespace lensd::autofocus
