// Disk blurs by OpenCV, FFTW and KissFFT, each where it was installed when lens-bench was built.
#include "bench/render/peers.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <type_traits>

#include <kissfft/kiss_fft.h>
#include <kissfft/kiss_fftnd.h>
#ifdef LENSD_HAVE_OPENCV
#include <opencv2/imgproc.hpp>
#endif
#ifdef LENSD_HAVE_FFTW
#include <fftw3.h>
#endif

namespace lensd::bench {
namespace {

#ifdef LENSD_HAVE_OPENCV
/// OpenCV looks beyond a region of interest into the picture it is cut from.
cv::Mat PartOf(const sim::Raster& source, const sim::Raster& out) {
  const cv::Mat whole(source.rect.height, source.rect.width, CV_32F, const_cast<float*>(source.values.data()));
  return whole(cv::Rect(out.rect.x - source.rect.x, out.rect.y - source.rect.y, out.rect.width, out.rect.height));
}

cv::Mat MatOf(sim::Raster& out) {
  return {out.rect.height, out.rect.width, CV_32F, out.values.data()};
}

void AddOpenCv(double diameter, std::vector<Peer>& peers) {
  cv::setNumThreads(1);
  const sim::DiskKernel kernel(diameter);
  const int side = 2 * kernel.reach + 1;
  cv::Mat weights(side, side, CV_32F);
  std::transform(kernel.weights.begin(), kernel.weights.end(), weights.begin<float>(),
                 [](double weight) { return static_cast<float>(weight); });
  peers.push_back({"OpenCV filter2D", [weights](const sim::Raster& source, sim::Raster& out) {
                     cv::Mat to = MatOf(out);
                     cv::filter2D(PartOf(source, out), to, CV_32F, weights);
                   }});
  // The same spread along each axis as the disk's, a quarter of its diameter.
  const double sigma = std::max(0.25 * diameter, 0.1);
  peers.push_back({"OpenCV Gaussian",
                   [sigma](const sim::Raster& source, sim::Raster& out) {
                     cv::Mat to = MatOf(out);
                     cv::GaussianBlur(PartOf(source, out), to, cv::Size(), sigma);
                   },
                   false});
  const int box = std::max(1, 2 * static_cast<int>(std::lround((0.866 * diameter - 1.0) / 2.0)) + 1);
  peers.push_back({"OpenCV box",
                   [box](const sim::Raster& source, sim::Raster& out) {
                     cv::Mat to = MatOf(out);
                     cv::blur(PartOf(source, out), to, cv::Size(box, box));
                   },
                   false});
}
#endif

int GoodSize(int least) {
  for (int size = (least + 7) / 8 * 8;; size += 8) {
    int rest = size;
    for (const int factor : {2, 3, 5, 7}) {
      while (rest % factor == 0) rest /= factor;
    }
    if (rest == 1) return size;
  }
}

#ifdef LENSD_HAVE_FFTW
/// Convolution in the plane of real transforms, planned with FFTW_MEASURE; the kernel's transform is prepared.
class FftwBlur {
 public:
  FftwBlur(double diameter, int width, int height)
      : kernel_(diameter), columns_(GoodSize(width + 2 * kernel_.reach)), rows_(GoodSize(height + 2 * kernel_.reach)) {
    plane_ = fftwf_alloc_real(Values());
    spectrum_ = fftwf_alloc_complex(Bins());
    fftwf_set_timelimit(3.0);
    forward_ = fftwf_plan_dft_r2c_2d(rows_, columns_, plane_, spectrum_, FFTW_MEASURE);
    backward_ = fftwf_plan_dft_c2r_2d(rows_, columns_, spectrum_, plane_, FFTW_MEASURE);
    std::fill_n(plane_, Values(), 0.0f);
    for (int y = -kernel_.reach; y <= kernel_.reach; ++y) {
      for (int x = -kernel_.reach; x <= kernel_.reach; ++x) {
        plane_[At((x + columns_) % columns_, (y + rows_) % rows_)] =
            static_cast<float>(kernel_.At(x, y) / static_cast<double>(Values()));
      }
    }
    fftwf_execute(forward_);
    for (std::size_t i = 0; i < Bins(); ++i) transfer_.push_back(spectrum_[i][0]);
  }
  FftwBlur(const FftwBlur&) = delete;
  FftwBlur& operator=(const FftwBlur&) = delete;
  ~FftwBlur() {
    fftwf_destroy_plan(forward_);
    fftwf_destroy_plan(backward_);
    fftwf_free(plane_);
    fftwf_free(spectrum_);
  }

  void operator()(const sim::Raster& source, sim::Raster& out) {
    const sim::PixelRect rect = sim::Grown(out.rect, kernel_.reach);
    for (int y = 0; y < rows_; ++y) {
      float* row = plane_ + At(0, y);
      const int used = y < rect.height ? rect.width : 0;
      if (used > 0) std::copy_n(source.Row(rect.y + y) + (rect.x - source.rect.x), used, row);
      std::fill(row + used, row + columns_, 0.0f);
    }
    fftwf_execute(forward_);
    for (std::size_t i = 0; i < Bins(); ++i) {
      spectrum_[i][0] *= transfer_[i];
      spectrum_[i][1] *= transfer_[i];
    }
    fftwf_execute(backward_);
    for (int y = 0; y < out.rect.height; ++y) {
      std::copy_n(plane_ + At(kernel_.reach, y + kernel_.reach), out.rect.width, out.Row(out.rect.y + y));
    }
  }

 private:
  std::size_t Values() const { return static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_); }
  std::size_t Bins() const { return static_cast<std::size_t>(columns_ / 2 + 1) * static_cast<std::size_t>(rows_); }
  std::size_t At(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(x);
  }

  sim::DiskKernel kernel_;
  int columns_;
  int rows_;
  float* plane_;
  fftwf_complex* spectrum_;
  fftwf_plan forward_;
  fftwf_plan backward_;
  std::vector<float> transfer_;
};
#endif

/// The same with KissFFT. The kernel is symmetric, its transform real: one complex transform carries the upper half of
/// the picture in its real part and the lower half in its imaginary part, and neither sees the other.
class KissBlur {
 public:
  KissBlur(double diameter, int width, int height)
      : kernel_(diameter),
        columns_(GoodSize(width + 2 * kernel_.reach)),
        rows_(GoodSize((height + 1) / 2 + 2 * kernel_.reach)),
        plane_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)),
        spectrum_(plane_.size()) {
    const int sizes[] = {rows_, columns_};
    forward_.reset(kiss_fftnd_alloc(sizes, 2, 0, nullptr, nullptr));
    backward_.reset(kiss_fftnd_alloc(sizes, 2, 1, nullptr, nullptr));
    for (int y = -kernel_.reach; y <= kernel_.reach; ++y) {
      for (int x = -kernel_.reach; x <= kernel_.reach; ++x) {
        plane_[At((x + columns_) % columns_, (y + rows_) % rows_)].r =
            static_cast<float>(kernel_.At(x, y) / static_cast<double>(plane_.size()));
      }
    }
    kiss_fftnd(forward_.get(), plane_.data(), spectrum_.data());
    for (const kiss_fft_cpx& bin : spectrum_) transfer_.push_back(bin.r);
  }

  void operator()(const sim::Raster& source, sim::Raster& out) {
    const int reach = kernel_.reach, half = (out.rect.height + 1) / 2;
    const sim::PixelRect rect = sim::Grown(out.rect, reach);
    std::fill(plane_.begin(), plane_.end(), kiss_fft_cpx{});
    for (int y = 0; y < half + 2 * reach; ++y) {
      const float* upper = source.Row(rect.y + y) + (rect.x - source.rect.x);
      const float* lower = source.Row(std::min(rect.y + y + half, rect.y + rect.height - 1)) + (rect.x - source.rect.x);
      for (int x = 0; x < rect.width; ++x) plane_[At(x, y)] = {upper[x], lower[x]};
    }
    kiss_fftnd(forward_.get(), plane_.data(), spectrum_.data());
    for (std::size_t i = 0; i < spectrum_.size(); ++i) {
      spectrum_[i].r *= transfer_[i];
      spectrum_[i].i *= transfer_[i];
    }
    kiss_fftnd(backward_.get(), spectrum_.data(), plane_.data());
    for (int y = 0; y < out.rect.height; ++y) {
      const kiss_fft_cpx* from = plane_.data() + At(reach, reach + (y < half ? y : y - half));
      float* to = out.Row(out.rect.y + y);
      for (int x = 0; x < out.rect.width; ++x) to[x] = y < half ? from[x].r : from[x].i;
    }
  }

 private:
  struct Free {
    void operator()(kiss_fftnd_cfg plan) const { kiss_fft_free(plan); }
  };
  using Plan = std::unique_ptr<std::remove_pointer_t<kiss_fftnd_cfg>, Free>;

  std::size_t At(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(x);
  }

  sim::DiskKernel kernel_;
  int columns_;
  int rows_;
  std::vector<kiss_fft_cpx> plane_, spectrum_;
  Plan forward_, backward_;
  std::vector<float> transfer_;
};

}  // namespace

std::vector<Peer> DiskPeers(double diameter_px, int width, int height) {
  std::vector<Peer> peers;
#ifdef LENSD_HAVE_OPENCV
  AddOpenCv(diameter_px, peers);
#endif
#ifdef LENSD_HAVE_FFTW
  const auto fftw = std::make_shared<FftwBlur>(diameter_px, width, height);
  peers.push_back({"FFTW convolution", [fftw](const sim::Raster& source, sim::Raster& out) { (*fftw)(source, out); }});
#endif
  const auto kiss = std::make_shared<KissBlur>(diameter_px, width, height);
  peers.push_back(
      {"KissFFT convolution", [kiss](const sim::Raster& source, sim::Raster& out) { (*kiss)(source, out); }});
  return peers;
}

std::vector<std::string> MissingPeers() {
  std::vector<std::string> missing;
#ifndef LENSD_HAVE_OPENCV
  missing.emplace_back("OpenCV");
#endif
#ifndef LENSD_HAVE_FFTW
  missing.emplace_back("FFTW");
#endif
  return missing;
}

}  // namespace lensd::bench
