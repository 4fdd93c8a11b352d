// The socket clients find us by.
#pragma once

#include <cstdint>
#include <string>

#include "base/result.h"

namespace lensd::daemon {

/// A listening Unix stream socket. Move-only; removes the path it made when destroyed.
class Listener {
 public:
  /// Uses the socket systemd passed (LISTEN_FDS), else binds `path`. A socket that no daemon answers is replaced.
  /// Code::Busy: another daemon answers there. Code::Io: the path cannot be used.
  static Result<Listener> Open(const std::string& path);
  Listener(Listener&& other) noexcept;
  Listener& operator=(Listener&&) = delete;
  ~Listener();

  int descriptor() const { return descriptor_; }
  /// Removes the path it made, unless that is another socket's by now; for a program that ends without destructors.
  void Remove();

 private:
  /// A socket in the file system; another program may have made its own in the same place since.
  struct Place {
    std::string path;  ///< empty: systemd's, or removed
    std::uint64_t device = 0, inode = 0;
  };
  explicit Listener(int descriptor) : descriptor_(descriptor) {}
  static Result<Listener> Bind(const std::string& path);

  int descriptor_;
  Place own_;
};

}  // namespace lensd::daemon
