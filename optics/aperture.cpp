#include "optics/aperture.h"

namespace lensd::optics {

std::array<Metres, 2> PinholeImage(Metres sensor_distance, const HomogeneousPoint& object) {
  const auto& [x, y, z, w] = object;
  return {sensor_distance * (x / z), sensor_distance * (y / z)};
}

// A ray from the scene point (X, Z) through the hole's point a meets the sensor at X d/Z - a (1 + d/Z) on the image
// side's axes: the pinhole image smeared by the hole, magnified about the scene point.
Disk LitBy(const Aperture& aperture, const HomogeneousPoint& object) {
  const auto [x, y] = PinholeImage(aperture.sensor_distance, object);
  const double vergence = object[3] / object[2];
  return {x, y, Blur(aperture, Dioptres{vergence})};
}

Disk SeenFrom(const Aperture& aperture, Metres x, Metres y, Metres depth) {
  const double scale = depth / aperture.sensor_distance;
  return {x * scale, y * scale, aperture.diameter * (1.0 + scale)};
}

Metres Blur(const Aperture& aperture, ObjectDepth object) {
  return aperture.diameter * (1.0 + aperture.sensor_distance.value * object.vergence().value);
}

}  // namespace lensd::optics
