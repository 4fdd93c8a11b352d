// Focus measures as recipes have them, and as quick as OpenCV can be made.
#include "bench/measure/peers.h"

#ifdef LENSD_HAVE_OPENCV
#include <opencv2/imgproc.hpp>
#endif

namespace lensd::bench {

#ifdef LENSD_HAVE_OPENCV
namespace {

cv::Mat MatOf(autofocus::GreyView<std::uint8_t> view) {
  return {view.height, view.width, CV_8U, const_cast<std::uint8_t*>(view.samples),
          static_cast<std::size_t>(view.stride)};
}

/// As recipes have it: slopes in double precision, squared, added, averaged.
double UsualTenengrad(autofocus::GreyView<std::uint8_t> view) {
  cv::Mat gx, gy;
  cv::Sobel(MatOf(view), gx, CV_64F, 1, 0);
  cv::Sobel(MatOf(view), gy, CV_64F, 0, 1);
  const cv::Mat energy = gx.mul(gx) + gy.mul(gy);
  return cv::mean(energy)[0];
}

/// The quickest way found: 16-bit slopes in bands of rows that stay in the cache, each squared by its norm.
double TunedTenengrad(autofocus::GreyView<std::uint8_t> view) {
  constexpr int kRows = 32;
  const cv::Mat whole = MatOf(view);
  cv::Mat gx, gy;
  double sum = 0.0;
  for (int y = 0; y < whole.rows; y += kRows) {
    const cv::Mat band = whole.rowRange(y, std::min(y + kRows, whole.rows));
    cv::spatialGradient(band, gx, gy, 3);
    sum += cv::norm(gx, cv::NORM_L2SQR) + cv::norm(gy, cv::NORM_L2SQR);
  }
  return sum;
}

double UsualLaplacian(autofocus::GreyView<std::uint8_t> view) {
  cv::Mat laplacian;
  cv::Laplacian(MatOf(view), laplacian, CV_64F);
  cv::Scalar mean, deviation;
  cv::meanStdDev(laplacian, mean, deviation);
  return deviation[0] * deviation[0];
}

double TunedLaplacian(autofocus::GreyView<std::uint8_t> view) {
  cv::Mat laplacian;
  cv::Laplacian(MatOf(view), laplacian, CV_16S);
  cv::Scalar mean, deviation;
  cv::meanStdDev(laplacian, mean, deviation);
  return deviation[0] * deviation[0];
}

double Brenner(autofocus::GreyView<std::uint8_t> view) {
  const cv::Mat whole = MatOf(view);
  cv::Mat difference;
  cv::absdiff(whole.colRange(2, whole.cols), whole.colRange(0, whole.cols - 2), difference);
  return cv::norm(difference, cv::NORM_L2SQR);
}

}  // namespace

std::vector<MeasurePeer> MeasurePeers() {
  cv::setNumThreads(1);
  return {{"OpenCV Tenengrad, usual", "Tenengrad", UsualTenengrad},
          {"OpenCV Tenengrad, tuned", "Tenengrad", TunedTenengrad},
          {"OpenCV Laplacian, usual", "Laplacian", UsualLaplacian},
          {"OpenCV Laplacian, tuned", "Laplacian", TunedLaplacian},
          {"OpenCV Brenner", "Brenner", Brenner}};
}
#else
std::vector<MeasurePeer> MeasurePeers() {
  return {};
}
#endif

}  // namespace lensd::bench
