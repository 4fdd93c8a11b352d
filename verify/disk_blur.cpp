// The plane is continued by its mirror image, transformed once, and multiplied by the disk's response for every
// diameter asked for.
#include "verify/disk_blur.h"

#include <kissfft/kiss_fftnd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <numbers>

namespace lensd::verify {
namespace {

int Mirrored(int index, int size) {
  while (index < 0 || index >= size) index = index < 0 ? -index - 1 : 2 * size - 1 - index;
  return index;
}

/// ResponseBetween of one diameter, from a table fine enough for single precision.
class Responses {
 public:
  Responses(double diameter_px, double opening) {
    for (int i = 0; i <= kEntries; ++i) {
      table_.push_back(ResponseBetween(diameter_px, opening, kHighest * i / kEntries));
    }
  }
  float At(double frequency) const {
    const double place = frequency * (kEntries / kHighest);
    const auto entry = static_cast<std::size_t>(place);
    const double part = place - static_cast<double>(entry);
    return static_cast<float>(table_[entry] + part * (table_[entry + 1] - table_[entry]));
  }

 private:
  static constexpr int kEntries = 4096;
  static constexpr double kHighest = 0.71;  // beyond the corner of the spectrum
  std::vector<double> table_;
};

double Frequency(int index, int size) {
  return (index <= size / 2 ? index : index - size) / static_cast<double>(size);
}

/// What a displacement does to each frequency of a row or column.
std::vector<std::complex<float>> Turns(double shift_px, int size) {
  std::vector<std::complex<float>> turns;
  for (int i = 0; i < size; ++i) {
    turns.emplace_back(std::polar(1.0, -2 * std::numbers::pi * Frequency(i, size) * shift_px));
  }
  return turns;
}

}  // namespace

// The library's real transform, kiss_fftndr_alloc, returns NULL in Debian 12's 131.1.0.
std::vector<std::complex<float>> Transformed(const std::vector<std::complex<float>>& in, int width, int height,
                                             Transform way) {
  const int dims[] = {height, width};
  const std::unique_ptr<kiss_fftnd_state, decltype(&std::free)> plan(
      kiss_fftnd_alloc(dims, 2, way == Transform::Inverse ? 1 : 0, nullptr, nullptr), &std::free);
  std::vector<std::complex<float>> out(in.size());
  kiss_fftnd(plan.get(), reinterpret_cast<const kiss_fft_cpx*>(in.data()), reinterpret_cast<kiss_fft_cpx*>(out.data()));
  return out;
}

double DiskResponse(double diameter_px, double frequency) {
  const double x = std::numbers::pi * diameter_px * frequency;
  return x < 1e-6 ? 1.0 : 2 * ::j1(x) / x;
}

double ResponseBetween(double diameter_px, double opening, double frequency) {
  constexpr double kLeast = 0.3;
  const double smaller = DiskResponse(opening * diameter_px, frequency);
  return DiskResponse(diameter_px, frequency) / std::max(smaller, kLeast);
}

DiskBlur::DiskBlur(const Plane& plane, double opening, int margin_px)
    : opening_(opening),
      width_(plane.width),
      height_(plane.height),
      margin_(margin_px),
      padded_width_(kiss_fft_next_fast_size(plane.width + 2 * margin_px)),
      padded_height_(kiss_fft_next_fast_size(plane.height + 2 * margin_px)) {
  std::vector<std::complex<float>> padded(static_cast<std::size_t>(padded_width_) * padded_height_);
  for (int y = 0; y < padded_height_; ++y) {
    const std::size_t from = static_cast<std::size_t>(Mirrored(y - margin_, height_)) * width_;
    for (int x = 0; x < padded_width_; ++x) {
      padded[static_cast<std::size_t>(y) * padded_width_ + x] = plane.values[from + Mirrored(x - margin_, width_)];
    }
  }
  spectrum_ = Transformed(padded, padded_width_, padded_height_, Transform::Forward);
}

Plane DiskBlur::Blurred(double diameter_px, Shift shift) const {
  std::vector<std::complex<float>> product(spectrum_.size());
  const Responses kept(diameter_px, opening_);
  const auto across = Turns(shift.x, padded_width_), down = Turns(shift.y, padded_height_);
  const float scale = 1.0f / static_cast<float>(product.size());
  for (int y = 0; y < padded_height_; ++y) {
    const double fy = Frequency(y, padded_height_);
    for (int x = 0; x < padded_width_; ++x) {
      const double fx = Frequency(x, padded_width_);
      const std::size_t at = static_cast<std::size_t>(y) * padded_width_ + x;
      product[at] = spectrum_[at] * across[x] * down[y] * (kept.At(std::sqrt(fx * fx + fy * fy)) * scale);
    }
  }
  const auto padded = Transformed(product, padded_width_, padded_height_, Transform::Inverse);
  Plane out{width_, height_, std::vector<float>(static_cast<std::size_t>(width_) * height_)};
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      out.values[static_cast<std::size_t>(y) * width_ + x] =
          padded[static_cast<std::size_t>(y + margin_) * padded_width_ + x + margin_].real();
    }
  }
  return out;
}

}  // namespace lensd::verify
