// One disk, and disks that vary across the frame.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "bench/cpu_time.h"
#include "bench/render/cases.h"
#include "bench/render/peers.h"
#include "sim/render/disk_filter.h"
#include "sim/render/disk_fourier.h"
#include "sim/render/varying_blur.h"

namespace lensd::bench {
namespace {

class Random {
 public:
  std::uint32_t Next() { return state_ = state_ * 1664525u + 1013904223u; }
  int Below(int bound) { return static_cast<int>((Next() >> 8) % static_cast<std::uint32_t>(bound)); }
  float Unit() { return static_cast<float>(Next() >> 8) / 16777216.0f; }

 private:
  std::uint32_t state_ = 1;
};

sim::Raster NoiseOver(sim::PixelRect rect) {
  sim::Raster raster(rect);
  Random random;
  for (float& value : raster.values) value = random.Unit();
  return raster;
}

double SumAt(const sim::Raster& source, const sim::DiskKernel& kernel, int x, int y) {
  double sum = 0.0;
  for (int dy = -kernel.reach; dy <= kernel.reach; ++dy) {
    for (int dx = -kernel.reach; dx <= kernel.reach; ++dx) {
      sum += kernel.At(dx, dy) * static_cast<double>(source.At(x + dx, y + dy));
    }
  }
  return sum;
}

/// Pixels to check, with what they should be.
struct Check {
  int x;
  int y;
  double light;
};

double LargestError(const sim::Raster& image, const std::vector<Check>& checks) {
  double largest = 0.0;
  for (const Check& check : checks) {
    largest = std::max(largest, std::abs(static_cast<double>(image.At(check.x, check.y)) - check.light));
  }
  return 255.0 * largest;
}

constexpr int kChecks = 500;

}  // namespace

std::vector<RenderRow> OneDiskRows(const RenderBenchOptions& options) {
  std::vector<RenderRow> rows;
  const sim::PixelRect rect{0, 0, options.width, options.height};
  for (const double diameter : {1.0, 3.0, 5.0, 7.0, 11.0, 15.0, 21.0, 31.0, 41.0, 61.0, 81.0, 101.0}) {
    const sim::DiskKernel kernel(diameter);
    const sim::Raster source = NoiseOver(sim::Grown(rect, kernel.reach));
    sim::Raster image(rect);
    Random random;
    std::vector<Check> checks;
    for (int i = 0; i < kChecks; ++i) {
      const int x = random.Below(rect.width);
      const int y = random.Below(rect.height);
      checks.push_back({x, y, SumAt(source, kernel, x, y)});
    }
    std::vector<Peer> all = DiskPeers(diameter, rect.width, rect.height);
    const std::size_t peers = all.size();
    const sim::DiskFilter direct(diameter, sim::DiskFilter::Method::Direct);
    const sim::DiskFilter runs(diameter, sim::DiskFilter::Method::Runs);
    const sim::DiskFourier fourier(diameter, rect.width, rect.height);
    const auto add = [&](const char* name, const auto& filter) {
      all.push_back({name, [&](const sim::Raster& from, sim::Raster& out) { filter.Blur(from, out); }});
    };
    if (diameter <= 21.0) add("lensd direct", direct);
    add("lensd runs", runs);
    add("lensd fourier", fourier);
    // What no blur can undercut: every pixel read and written once.
    all.push_back({"copy once", [](const sim::Raster& from, sim::Raster& out) {
                     for (int y = out.rect.y; y < out.rect.y + out.rect.height; ++y) {
                       std::copy_n(from.Row(y) + (out.rect.x - from.rect.x), out.rect.width, out.Row(y));
                     }
                   }});
    for (std::size_t i = 0; i < all.size(); ++i) {
      std::fill(image.values.begin(), image.values.end(), 0.0f);
      const double ms = MedianCpuMs(options.repeats, [] {}, [&] { all[i].blur(source, image); });
      rows.push_back({.family = "one disk",
                      .renderer = all[i].name,
                      .peer = i < peers,
                      .diameter_px = diameter,
                      .elapsed_ms = ms,
                      .interior_error = LargestError(image, checks)});
    }
  }
  return rows;
}

std::vector<RenderRow> VaryingDiskRows(const RenderBenchOptions& options) {
  const sim::PixelRect rect{0, 0, options.width, options.height};
  const double largest = 41.0;
  const sim::Raster source = NoiseOver(sim::Grown(rect, sim::ReachOf(largest)));
  sim::Raster diameters(rect);
  for (int y = 0; y < rect.height; ++y) {
    for (int x = 0; x < rect.width; ++x)
      diameters.Row(y)[x] = static_cast<float>(1.0 + (largest - 1.0) * x / (rect.width - 1));
  }
  sim::Raster image(rect);
  const double quick_ms =
      MedianCpuMs(options.repeats, [] {}, [&] { sim::BlurVarying(sim::SummedRaster(source), diameters, image); });
  // The naive way: every pixel sums the cells of its own disk. Kernels are shared by column, and every 16th row is
  // timed: the rest costs the same.
  const int step = 16;
  std::vector<sim::DiskKernel> kernels;
  for (int x = 0; x < rect.width; ++x) {
    kernels.push_back(sim::DiskKernel::Sparse(static_cast<double>(diameters.At(x, 0))));
  }
  double error = 0.0;
  const double start = ThreadCpuMs();
  int timed = 0;
  for (int y = 0; y < rect.height; y += step, ++timed) {
    for (int x = 0; x < rect.width; ++x) {
      const double light = SumAt(source, kernels[static_cast<std::size_t>(x)], x, y);
      error = std::max(error, std::abs(light - static_cast<double>(image.At(x, y))));
    }
  }
  const double naive_ms = (ThreadCpuMs() - start) * rect.height / timed;
  return {{.family = "varying disk",
           .renderer = "naive gather",
           .peer = true,
           .diameter_px = largest,
           .elapsed_ms = naive_ms,
           .interior_error = 0.0},
          {.family = "varying disk",
           .renderer = "lensd gather",
           .diameter_px = largest,
           .elapsed_ms = quick_ms,
           .interior_error = 255.0 * error}};
}

}  // namespace lensd::bench
