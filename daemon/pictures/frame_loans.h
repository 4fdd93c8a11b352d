// Frames lent to clients as sealed memory, and how it is seen that they have been given back.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

#include "base/result.h"
#include "loop/descriptor.h"

namespace lensd::daemon {

/// From any thread. A frame lent is a memfd that no process can write to or resize any more. It is given back when
/// every descriptor and mapping of it but lensd's own is gone, of which no word comes: lensd keeps a second open file
/// of the same memory and asks the kernel for a write lease on that (fcntl(2), F_SETLEASE), which it gets once it is
/// the last. So what clients can make lensd hold is bounded, whatever they do with what they have got.
class FrameLoans {
 public:
  static constexpr std::size_t kMostOfOne = 3;
  static constexpr std::size_t kMostBytes = std::size_t{256} << 20;  ///< lent in all, and not given back

  /// A number that no other borrower has.
  std::uint64_t NewBorrower() { return ++borrowers_; }
  /// Whether `borrower` holds as many frames as it may, or all hold as much as they may together.
  bool Full(std::uint64_t borrower);
  /// The bytes as a sealed file open for reading, from its start. Io: no memory or descriptors to be had. Unsupported:
  /// a kernel that does not tell what was given back.
  Result<Descriptor> Lend(std::uint64_t borrower, std::span<const std::uint8_t> bytes);

 private:
  struct Loan {
    std::uint64_t borrower;
    std::size_t bytes;
    Descriptor ours;
  };
  void Collect();

  std::atomic<std::uint64_t> borrowers_ = 0;
  std::mutex mutex_;
  std::vector<Loan> loans_;  // guarded by mutex_
};

}  // namespace lensd::daemon
