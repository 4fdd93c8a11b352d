// One ray after the other, in double precision: what the fast renderers are measured against.
#include "sim/render/ray_tracer.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <optional>

#include "sim/render/cell_walk.h"

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
      if (top >= leaves) return Hit{top, ray.XAt(top), ray.YAt(top), true};
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

std::vector<PixelRay> SpreadOverPixel(int count, const ApertureShape& shape) {
  const std::vector<AperturePoint> points = SpreadOverAperture(count, shape);
  const auto size = static_cast<std::int64_t>(points.size());
  // Steps without small relations to each other or the golden mean, which the aperture's points follow.
  const auto step_near = [size](double part) {
    auto step = std::max(std::int64_t{1}, static_cast<std::int64_t>(std::lround(part * static_cast<double>(size))));
    while (std::gcd(step, size) != 1) ++step;
    return step;
  };
  const std::int64_t step_x = step_near(std::numbers::sqrt2 - 1.0), step_y = step_near(std::numbers::sqrt3 - 1.0);
  std::vector<PixelRay> rays;
  for (std::int64_t i = 0; i < size; ++i) {
    const auto along = [&](std::int64_t step) {
      return (static_cast<double>(i * step % size) + 0.5) / static_cast<double>(size) - 0.5;
    };
    rays.push_back({{along(step_x), along(step_y)}, points[static_cast<std::size_t>(i)]});
  }
  return rays;
}

int RayReach(const std::vector<Canvas>& canvases, const BlurLine& line, const ApertureShape& shape,
             const Pupil& pupil) {
  double largest = 0.0;
  double off = 0.0;
  for (const Canvas& canvas : canvases) {
    largest = std::max({largest, std::abs(line.At(canvas.min_vergence())), std::abs(line.At(canvas.max_vergence()))});
    off = std::max({off, pupil.Reach(canvas.min_vergence()), pupil.Reach(canvas.max_vergence())});
  }
  return static_cast<int>(std::ceil(shape.reach() * largest + off)) + 1;
}

/// What a ray meets first.
struct RayTracer::Seen {
  Hit hit;
  std::size_t surface;
};

RayTracer::RayTracer(const std::vector<Canvas>& canvases, const std::vector<CellLight>& light, BlurLine line,
                     const ApertureShape& shape, const Pupil& pupil, int rays_per_pixel)
    : canvases_(canvases), light_(light), line_(line), pupil_(pupil), rays_(SpreadOverPixel(rays_per_pixel, shape)) {
  if (line.at_infinity_px == 0.0 && line.per_dioptre_px == 0.0) rays_.clear();
}

std::optional<RayTracer::Seen> RayTracer::FirstSeen(int x, int y, PixelRay pixel_ray, const BlurLine& line) const {
  const Ray ray{x + 0.5 + pixel_ray.on_sensor.x, y + 0.5 + pixel_ray.on_sensor.y, pixel_ray.through, line};
  std::optional<Seen> first;
  for (std::size_t i = 0; i < canvases_.size(); ++i) {
    const std::optional<Hit> hit = HitSurface(canvases_[i], ray);
    if (!hit || (first && hit->vergence_d <= first->hit.vergence_d)) continue;
    first = Seen{*hit, i};
  }
  return first;
}

double RayTracer::LightSeen(const Seen& seen, AperturePoint on_sensor) const {
  const Hit& hit = seen.hit;
  const Canvas& canvas = canvases_[seen.surface];
  // A formula says what pixels show: it is not averaged over them once more.
  if (!std::holds_alternative<TexturePaint>(canvas.paint()))
    return canvas.LightAt(hit.x - on_sensor.x, hit.y - on_sensor.y);
  const int column = CellOf(hit.x), row = CellOf(hit.y);
  const CellLight& light = light_[seen.surface];
  return light.mean.Holds(column, row) ? light.At(column, row, hit.x - column - 0.5, hit.y - row - 0.5)
                                       : static_cast<double>(canvas.CellLight(column, row));
}

double RayTracer::LightAt(int x, int y) const {
  const FieldPoint at = pupil_.FieldAt(x + 0.5, y + 0.5);
  const BlurLine line = pupil_.is_perfect() ? line_ : pupil_.LineAt(line_, at);
  double sum = 0.0;
  std::size_t known = 0, dark = 0;
  for (const PixelRay& ray : rays_) {
    PixelRay bent = ray;
    if (!pupil_.is_perfect()) {
      if (!pupil_.Passes(ray.through, at)) {
        ++dark;
        continue;
      }
      const AperturePoint off = pupil_.LandsOff(ray.through, at);
      bent.on_sensor = {ray.on_sensor.x - off.x, ray.on_sensor.y - off.y};
    }
    const std::optional<Seen> seen = FirstSeen(x, y, bent, line);
    if (seen && !seen->hit.known) continue;
    ++known;
    if (seen) sum += LightSeen(*seen, ray.on_sensor);
  }
  const double share = dark == 0 ? 1.0 : 1.0 - static_cast<double>(dark) / static_cast<double>(rays_.size());
  if (known > 0) return share * sum / static_cast<double>(known);
  // The ray through the lens centre never meets a side; without any other it stands for the whole pixel.
  const std::optional<Seen> seen = FirstSeen(x, y, {}, line);
  return seen ? share * static_cast<double>(canvases_[seen->surface].CellLight(x, y)) : 0.0;
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
