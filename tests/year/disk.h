// The disk under the state folder: slow, full, failing, and after a power cut only what was flushed.
#pragma once

#include <cstdint>
#include <string>

#include "machine.h"

namespace lensd::year::disk {

/// From now on files in this folder are on the disk; it is there already. What was in the folder before is on it.
void Mount(const std::string& folder);
/// Every call fails with a probability, and takes a time about so long.
struct Trouble {
  double fails = 0.0;
  std::int64_t slow = 0;  ///< ns, mean
};
void Set(const Trouble& trouble);
/// The thread that makes the n-th call from now is killed in the midst of it (machine::StopHere()). 0: not any more.
void KillAtCall(std::uint64_t n);
/// What was not flushed is lost, all of it or a part. To be called while no thread uses the disk.
void LosePower(Chance& chance);
/// What a killed process has written gets to the disk in time.
void FlushAll();
/// Planted: fsync() of a file does nothing.
void Lie();

struct Counts {
  std::uint64_t calls = 0, failed = 0, replaced = 0;
};
const Counts& counts();

}  // namespace lensd::year::disk
