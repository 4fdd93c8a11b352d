// What can be focused on in a scene.
#pragma once

#include <vector>

#include "sim/world.h"

namespace lensd::sim {

/// By the rule of Truth::subjects(). Empty only where the region shows nothing at all.
std::vector<SubjectDepth> SubjectsIn(const Scene& scene);

}  // namespace lensd::sim
