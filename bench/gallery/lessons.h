// Charts that teach: each says what it is of in the lecture, how to read it and what it means. What is chosen (a lens,
// a distance) is chosen here; every number that follows from it is asked of optics/.
#pragma once

#include <string>
#include <vector>

#include "base/units.h"
#include "io/svg.h"

namespace lensd::bench {

inline constexpr Metres kNormal{0.05};  // the focal length of most lessons

/// One page of the gallery.
struct Lesson {
  std::string name;   ///< of its file, without the ending
  std::string topic;  ///< of the lecture
  std::vector<io::Chart> charts;
  int columns = 1;
  std::string read;   ///< one sentence
  std::string means;  ///< one sentence
};

Lesson SignedBlurLesson();
Lesson TiltedPlaneLesson();
Lesson ConjugatesLesson();
Lesson PinholeLesson();
Lesson HoleAndLensLesson();
Lesson FNumberLesson();
Lesson DepthOfFieldLesson();
Lesson RaysLesson();

/// All of them, in the order of the lecture.
std::vector<Lesson> Lessons();

/// The whole page: topic, charts and both sentences.
std::string SvgOf(const Lesson& lesson);

/// Widths of a page and of one of two charts beside each other, px.
inline constexpr int kPageWidth = 860, kHalfWidth = 430;

/// Where the lesson of the tilted plane stands, for its frame: vergence u0 + ux x, x from -1 to 1 across the frame.
struct TiltedPlane {
  Metres focal_length{0.025};
  FNumber f_number{2.8};
  Dioptres u0{0.8}, ux{0.5};
  Dioptres focus{0.9};
};

/// What is most often chosen: light in the middle of what is seen.
inline constexpr Metres kGreen{550e-9};
/// "550 nm".
std::string Nanometres(Metres wavelength);

/// The opening at which a hole this far before its sensor images a subject sharpest: the least disk of geometry and
/// diffraction together (Airy), and that disk.
struct SharpestHole {
  Metres diameter, disk;
};
SharpestHole Sharpest(Metres sensor_distance, Dioptres subject);

/// Diameters of a hole's disk on the sensor: by geometry, by diffraction, and both together.
struct HoleDisks {
  Metres geometric, diffraction, total;
};
HoleDisks DisksOfHole(Metres diameter, Metres sensor_distance, Dioptres subject);

}  // namespace lensd::bench
