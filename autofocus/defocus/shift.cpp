// The correlation at whole pixels, as a sum over the low frequencies that blur spares; then a parabola through its top.
#include "autofocus/defocus/shift.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lensd::autofocus::defocus {
namespace {

constexpr int kSearched = 8;         // px to either side
constexpr double kHighest = 0.15;    // cycles per px: beyond, blur leaves little and noise shifts the peak
constexpr double kLowestBins = 2.5;  // below, the window itself correlates, and it does not move
constexpr double kClearShift = 0.4;  // px
constexpr double kLeastAlike = 0.2;  // correlation coefficient: less is another picture
constexpr double kShows = 30.0;      // times what rounding leaves: less is the steps between samples
constexpr double kClearGain = 0.02;  // of the correlation at no shift
constexpr double kReversed = 0.8;    // of the best correlation: as unlike unmoved as alike at best

double Along(int index, int size) {
  return (index <= size / 2 ? index : index - size) / static_cast<double>(size);
}

/// Correlation at whole shifts, row by row: first along x for each row of modes, then along y.
class Correlation {
 public:
  static constexpr int kSide = 2 * kSearched + 1;

  Correlation(const Tiles& first, const Tiles& second) {
    for (std::size_t tile = 0; tile < first.size(); ++tile) Add(first[tile], second[tile]);
  }
  /// Correlation coefficient of what is not noise.
  double Alike(int dx, int dy) const {
    return At(dx, dy) / std::sqrt(std::max(first_power_, 1e-15) * std::max(second_power_, 1e-15));
  }
  /// Either picture is more than samples that go up or down by one.
  bool BothShow() const { return std::min(first_power_, second_power_) > kShows * rounding_; }
  double At(int dx, int dy) const { return values_[dy + kSearched][dx + kSearched]; }

 private:
  void Add(const Spectrum& first, const Spectrum& second) {
    const int columns = std::min(first.columns(), static_cast<int>(kHighest * first.width) + 1);
    const double lowest = kLowestBins / std::min(first.width, first.height);
    for (int j = 0; j < first.height; ++j) {
      const double fy = Along(j, first.height);
      if (std::abs(fy) > kHighest) continue;
      std::complex<double> row[kSide] = {};
      for (int i = 0; i < columns; ++i) {
        const double fx = static_cast<double>(i) / first.width;
        const double f = std::hypot(fx, fy);
        if (f > kHighest || f < lowest) continue;
        const auto mode = static_cast<std::size_t>(j * first.columns() + i);
        const double weight = i == 0 ? 0.5 : 1.0;
        const std::complex<double> a(first.modes[mode]), b(second.modes[mode]);
        const std::complex<double> cross = a * std::conj(b) * weight;
        first_power_ += (std::norm(a) - first.noise) * weight;
        second_power_ += (std::norm(b) - second.noise) * weight;
        rounding_ += std::max(first.rounding, second.rounding) * weight;
        const std::complex<double> turn = std::polar(1.0, 2.0 * std::numbers::pi * fx);
        std::complex<double> phase = std::polar(1.0, -2.0 * std::numbers::pi * fx * kSearched);
        for (std::complex<double>& sum : row) {
          sum += cross * phase;
          phase *= turn;
        }
      }
      for (int dy = -kSearched; dy <= kSearched; ++dy) {
        const std::complex<double> phase = std::polar(1.0, 2.0 * std::numbers::pi * fy * dy);
        for (int dx = 0; dx < kSide; ++dx) values_[dy + kSearched][dx] += (row[dx] * phase).real();
      }
    }
  }

  double values_[kSide][kSide] = {};
  double first_power_ = 0.0;
  double second_power_ = 0.0;
  double rounding_ = 0.0;
};

/// Vertex of the parabola through three neighbours.
double Vertex(double before, double here, double after) {
  const double bend = before - 2.0 * here + after;
  return bend < 0 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0.0;
}

}  // namespace

Shift ShiftBetween(const Tiles& first, const Tiles& second) {
  const Correlation correlation(first, second);
  int x = 0, y = 0;
  for (int dy = -kSearched; dy <= kSearched; ++dy) {
    for (int dx = -kSearched; dx <= kSearched; ++dx) {
      if (correlation.At(dx, dy) > correlation.At(x, y)) x = dx, y = dy;
    }
  }
  Shift shift;
  // A pattern of one period whose contrast the blur has turned round looks like one that moved by half of it.
  if (-correlation.At(0, 0) > kReversed * correlation.At(x, y)) return shift;
  if (!correlation.BothShow()) return shift;
  shift.unlike = correlation.Alike(x, y) < kLeastAlike;
  shift.lost = shift.unlike || std::abs(x) == kSearched || std::abs(y) == kSearched;
  if (shift.lost) return shift;
  shift.x = x + Vertex(correlation.At(x - 1, y), correlation.At(x, y), correlation.At(x + 1, y));
  shift.y = y + Vertex(correlation.At(x, y - 1), correlation.At(x, y), correlation.At(x, y + 1));
  const double gain = correlation.At(x, y) - correlation.At(0, 0);
  const bool far = x != 0 || y != 0;
  shift.clear = std::hypot(shift.x, shift.y) > kClearShift && (!far || gain > kClearGain * correlation.At(x, y));
  return shift;
}

static void MoveOne(Spectrum& spectrum, const Shift& shift) {
  for (int j = 0; j < spectrum.height; ++j) {
    const double fy = Along(j, spectrum.height);
    for (int i = 0; i < spectrum.columns(); ++i) {
      const double turns = static_cast<double>(i) / spectrum.width * shift.x + fy * shift.y;
      spectrum.modes[static_cast<std::size_t>(j * spectrum.columns() + i)] *=
          std::complex<float>(std::polar(1.0, 2.0 * std::numbers::pi * turns));
    }
  }
}

void Move(Tiles& tiles, const Shift& shift) {
  for (Spectrum& spectrum : tiles) MoveOne(spectrum, shift);
}

}  // namespace lensd::autofocus::defocus
