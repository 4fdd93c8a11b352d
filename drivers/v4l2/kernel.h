// The kernel's side of this driver as a seam: tests replay what no packaged kernel module can show (voice coils, media
// graphs with a lens, failing buses).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"

namespace lensd::drivers::v4l2 {

/// System calls on device nodes. Numbers below zero are -errno.
class Kernel {
 public:
  virtual ~Kernel() = default;
  /// A file descriptor, for reading and writing without waiting.
  virtual int Open(const std::string& path) = 0;
  virtual void Close(int fd) = 0;
  /// Repeats what a signal interrupted.
  virtual int Ioctl(int fd, unsigned long request, void* argument) = 0;
  /// Shared memory of a device; nullptr: none.
  virtual void* Map(int fd, std::size_t length, std::int64_t offset) = 0;
  virtual void Unmap(void* memory, std::size_t length) = 0;
  /// Plain transfers, where a bus offers them.
  virtual int Read(int fd, void* into, std::size_t length) = 0;
  /// Paths "FOLDER/PREFIX*", sorted by length and then by letter.
  virtual std::vector<std::string> List(const std::string& folder, const std::string& prefix) = 0;
  /// A small file's text; empty where it cannot be read.
  virtual std::string Text(const std::string& path) = 0;
};

/// The machine's own.
Kernel& RealKernel();

/// What an errno of this driver's calls means. `what` was tried: "setting focus_absolute".
std::unexpected<Error> KernelError(int error, const std::string& what);

/// One open node.
class Node {
 public:
  /// Disconnected: there is no such node; Io: no permission.
  static Result<Node> Open(Kernel& kernel, const std::string& path);
  Node() = default;
  Node(Node&& other) noexcept { *this = std::move(other); }
  Node& operator=(Node&& other) noexcept;
  ~Node();

  /// 0 or -errno.
  int Ioctl(unsigned long request, void* argument) const { return kernel_->Ioctl(fd_, request, argument); }
  Kernel& kernel() const { return *kernel_; }
  int fd() const { return fd_; }
  const std::string& path() const { return path_; }

 private:
  Kernel* kernel_ = nullptr;
  int fd_ = -1;
  std::string path_;
};

}  // namespace lensd::drivers::v4l2
