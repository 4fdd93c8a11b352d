// The socket clients find us by.
#pragma once

#include <string>

#include "base/result.h"

namespace lensd::daemon {

/// A listening Unix stream socket. Move-only; removes the path it made when destroyed.
class Listener {
 public:
  /// Uses the socket systemd passed (LISTEN_FDS), else binds `path`. A path whose socket nobody answers is replaced.
  /// Code::Busy: another daemon answers there. Code::Io: the path cannot be used.
  static Result<Listener> Open(const std::string& path);
  Listener(Listener&& other) noexcept;
  Listener& operator=(Listener&&) = delete;
  ~Listener();

  int descriptor() const { return descriptor_; }
  /// Removes the path it made, for a program that ends without destructors.
  void Remove();

 private:
  Listener(int descriptor, std::string own_path) : descriptor_(descriptor), own_path_(std::move(own_path)) {}
  static Result<Listener> Bind(const std::string& path);

  int descriptor_;
  std::string own_path_;  // empty: systemd's
};

}  // namespace lensd::daemon
