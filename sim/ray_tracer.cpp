#include "ray_tracer.h"

#include <cmath>
#include <cstdint>
#include <optional>

#include "cell_walk.h"

namespace lensd::sim {
namespace {

/// A ray in picture coordinates: at vergence U it is at (x, y) - h d(U).
struct Ray {
  double x;
  double y;
  AperturePoint h;
  const BlurLine& line;

  double XAt(double vergence_d) const { return x - h.x * line.At(vergence_d); }
  double YAt(double vergence_d) const { return y - h.y * line.At(vergence_d); }
};

struct Hit {
  double vergence_d;
  double x;  ///< place on the surface
  double y;
  bool known;  ///< false: the side of a depth map's cell
};

int CellOf(double at) {
  return static_cast<int>(std::floor(at));
}

/// On a plane U is affine along the picture and the picture affine in U along the ray: one linear equation.
std::optional<Hit> HitPlane(const Canvas& canvas, const Ray& ray) {
  const double turn = canvas.slope_x() * ray.h.x + canvas.slope_y() * ray.h.y;
  const double denominator = 1.0 + ray.line.per_dioptre_px * turn;
  if (denominator <= 0.0) return std::nullopt;  // seen from behind
  const double vergence = (canvas.PlaneVergence(ray.x, ray.y) - ray.line.at_infinity_px * turn) / denominator;
  const Hit hit{vergence, ray.XAt(vergence), ray.YAt(vergence), true};
  if (!canvas.CoversAll() && !canvas.Covers(CellOf(hit.x), CellOf(hit.y))) return std::nullopt;
  return hit;
}

/// A depth map is a field of columns, one a cell, rising from infinitely far to the cell's vergence. The ray goes down
/// in vergence, cell by cell: it meets a column's top where that lies between the vergences at which it enters and
/// leaves the cell, and the column's side where the top is nearer than where it enters.
std::optional<Hit> HitDepthMap(const Canvas& canvas, const Ray& ray) {
  const double near = canvas.max_vergence();
  const double far = canvas.min_vergence();
  CellWalk walk(ray.XAt(near), ray.YAt(near), ray.XAt(far), ray.YAt(far));
  double entered = near;
  for (;;) {
    const double leaves = walk.AtEnd() ? far : near + (far - near) * walk.Until();
    if (canvas.Covers(walk.x(), walk.y())) {
      const double top = static_cast<double>(canvas.CellVergence(walk.x(), walk.y()));
      if (top > entered) return Hit{entered, walk.x() + 0.5, walk.y() + 0.5, false};
      if (top >= leaves) return Hit{top, walk.x() + 0.5, walk.y() + 0.5, true};
    }
    if (walk.AtEnd()) return std::nullopt;
    walk.Advance();
    entered = leaves;
  }
}

std::optional<Hit> HitSurface(const Canvas& canvas, const Ray& ray) {
  return canvas.is_plane() ? HitPlane(canvas, ray) : HitDepthMap(canvas, ray);
}

}  // namespace

std::vector<AperturePoint> SpreadOverAperture(int count, const ApertureShape& shape) {
  int previous = 1;
  int size = 1;
  while (size < count) {
    const int next = size + previous;
    previous = size;
    size = next;
  }
  std::vector<AperturePoint> points;
  for (int i = 0; i < size; ++i) {
    const double along = (i + 0.5) / size;
    const double squared_radius = 1.0 - std::abs(2.0 * along - 1.0);
    const auto turns = static_cast<double>(static_cast<std::int64_t>(i) * previous % size) / size;
    points.push_back(shape.PointAt(0.5 * std::sqrt(squared_radius), turns));
  }
  return points;
}

RayTracer::RayTracer(const std::vector<Canvas>& canvases, BlurLine line, const ApertureShape& shape, int rays_per_pixel)
    : canvases_(canvases), line_(line), points_(SpreadOverAperture(rays_per_pixel, shape)) {
  const bool no_blur = line.at_infinity_px == 0.0 && line.per_dioptre_px == 0.0;
  if (no_blur) points_ = {AperturePoint{}};
}

std::optional<double> RayTracer::Follow(double x, double y, AperturePoint point) const {
  const Ray ray{x, y, point, line_};
  std::optional<Hit> nearest;
  const Canvas* on = nullptr;
  for (const Canvas& canvas : canvases_) {
    const std::optional<Hit> hit = HitSurface(canvas, ray);
    if (!hit || (nearest && hit->vergence_d <= nearest->vergence_d)) continue;
    nearest = hit;
    on = &canvas;
  }
  if (!nearest) return 0.0;
  if (!nearest->known) return std::nullopt;
  return on->LightAt(nearest->x, nearest->y);
}

double RayTracer::LightAt(double x, double y) const {
  double sum = 0.0;
  std::size_t seen = 0;
  for (const AperturePoint& point : points_) {
    const std::optional<double> light = Follow(x, y, point);
    if (!light) continue;
    ++seen;
    sum += *light;
  }
  // The ray through the lens centre never meets a side.
  return seen == 0 ? Follow(x, y, {}).value_or(0.0) : sum / static_cast<double>(seen);
}

bool IsSeen(const std::vector<Canvas>& canvases, const BlurLine& line, double x, double y, double vergence_d,
            AperturePoint through) {
  const double away = line.At(vergence_d);
  const Ray ray{x + through.x * away, y + through.y * away, through, line};
  for (const Canvas& canvas : canvases) {
    const std::optional<Hit> hit = HitSurface(canvas, ray);
    if (hit && hit->vergence_d > vergence_d) return false;
  }
  return true;
}

}  // namespace lensd::sim
