// Sealed memory for one frame each; given back is what a write lease can be had of.
#include "daemon/pictures/frame_loans.h"

#include <fcntl.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

namespace lensd::daemon {
namespace {

std::unexpected<Error> NoMemory(const char* what) {
  return Fail(Code::Io, std::string("a frame cannot be lent: ") + what + ": " + std::strerror(errno));
}

/// A lease is asked for and, where it is granted, let go again: nothing else is known by then to hold the memory.
bool GivenBack(int descriptor) {
  return fcntl(descriptor, F_SETLEASE, F_WRLCK) == 0;
}

Result<void> Fill(int file, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t count = write(file, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return NoMemory("writing");
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return {};
}

Result<Descriptor> SealedMemory(std::span<const std::uint8_t> bytes) {
  constexpr int kTries = 3;
  for (int tries = 1;; ++tries) {
    Descriptor memory(memfd_create("lensd-frame", MFD_CLOEXEC | MFD_ALLOW_SEALING));
    if (!memory) return NoMemory("memfd_create");
    if (auto filled = Fill(memory.get(), bytes); !filled) return PassOn(filled);
    if (fcntl(memory.get(), F_ADD_SEALS, F_SEAL_WRITE | F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) == 0) return memory;
    // Busy: the kernel itself holds one of the pages, as where it moves memory about. Other pages are hardly so too.
    if (errno != EBUSY || tries == kTries) return NoMemory("sealing");
  }
}

}  // namespace

void FrameLoans::Collect() {
  std::erase_if(loans_, [](const Loan& loan) { return GivenBack(loan.ours.get()); });
}

bool FrameLoans::Full(std::uint64_t borrower) {
  const std::lock_guard lock(mutex_);
  Collect();
  std::size_t bytes = 0;
  for (const Loan& loan : loans_) bytes += loan.bytes;
  const auto held = std::ranges::count(loans_, borrower, &Loan::borrower);
  return bytes >= kMostBytes || static_cast<std::size_t>(held) >= kMostOfOne;
}

Result<Descriptor> FrameLoans::Lend(std::uint64_t borrower, std::span<const std::uint8_t> bytes) {
  auto sealed = SealedMemory(bytes);
  if (!sealed) return PassOn(sealed);
  Descriptor memory = std::move(*sealed);
  const std::string path = "/proc/self/fd/" + std::to_string(memory.get());
  Descriptor ours(open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!ours) return NoMemory(path.c_str());
  memory = Descriptor();  // it could write: with it open no lease is ever granted
  if (!GivenBack(ours.get())) {
    return Fail(
        Code::Unsupported,
        std::string("frames cannot be passed as files: this kernel does not report when they are given back (") +
            std::strerror(errno) + "); ask for them without fd");
  }
  (void)fcntl(ours.get(), F_SETLEASE, F_UNLCK);
  const std::string again = "/proc/self/fd/" + std::to_string(ours.get());
  Descriptor theirs(open(again.c_str(), O_RDONLY | O_CLOEXEC));
  if (!theirs) return NoMemory(again.c_str());
  const std::lock_guard lock(mutex_);
  loans_.push_back({borrower, bytes.size(), std::move(ours)});
  return theirs;
}

}  // namespace lensd::daemon
