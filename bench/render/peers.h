// What others offer for a disk blur, each where it was there at build time.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "sim/render/disk_kernel.h"
#include "sim/render/raster.h"

namespace lensd::bench {

/// A way to blur `source` into `out`, whose rectangle grown by the kernel's reach lies within the source's.
using DiskBlur = std::function<void(const sim::Raster& source, sim::Raster& out)>;

struct Peer {
  std::string name;
  DiskBlur blur;
  bool exact = true;  ///< false: another kernel of the same width, quick but not a disk
};

/// Peers for one disk over results of that size. What can be prepared is prepared here.
std::vector<Peer> DiskPeers(double diameter_px, int width, int height);

/// Peers this build lacks, by name.
std::vector<std::string> MissingPeers();

}  // namespace lensd::bench
