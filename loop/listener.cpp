// The socket, handed over by systemd or made at --socket, and removed only by who made it.
#include "loop/listener.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <systemd/sd-daemon.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace lensd::daemon {
namespace {

Result<sockaddr_un> AddressOf(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof(address.sun_path)) {
    return Fail(Code::InvalidArgument, "a socket path has 1 to " + std::to_string(sizeof(address.sun_path) - 1) +
                                           " characters; this one has " + std::to_string(path.size()));
  }
  path.copy(address.sun_path, path.size());
  return address;
}

const sockaddr* Generic(const sockaddr_un& address) {
  return reinterpret_cast<const sockaddr*>(&address);
}

/// Makes way for our own socket, unless a daemon is listening there.
Result<void> ReplaceStale(const std::string& path, const sockaddr_un& address) {
  struct stat found{};
  if (lstat(path.c_str(), &found) != 0) return {};
  if (!S_ISSOCK(found.st_mode)) return Fail(Code::Io, path + " exists and is not a socket; remove it or name another");
  const int probe = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const bool answered = connect(probe, Generic(address), sizeof(address)) == 0;
  const int why = errno;
  close(probe);
  if (answered) return Fail(Code::Busy, "another daemon answers at " + path + "; stop it or name another socket");
  if (why != ECONNREFUSED) return Fail(Code::Io, path + " cannot be probed: " + std::strerror(why));
  unlink(path.c_str());
  return {};
}

}  // namespace

Result<Listener> Listener::Open(const std::string& path) {
  const int passed = sd_listen_fds(/*unset_environment=*/1);
  if (passed < 1) return Bind(path);
  const int descriptor = SD_LISTEN_FDS_START;
  if (passed > 1 || sd_is_socket_unix(descriptor, SOCK_STREAM, 1, nullptr, 0) <= 0) {
    return Fail(Code::InvalidArgument, "systemd must pass exactly one listening Unix stream socket; see lensd.socket");
  }
  fcntl(descriptor, F_SETFL, fcntl(descriptor, F_GETFL) | O_NONBLOCK);
  return Listener(descriptor);
}

Result<Listener> Listener::Bind(const std::string& path) {
  auto address = AddressOf(path);
  if (!address) return PassOn(address);
  if (auto free = ReplaceStale(path, *address); !free) return PassOn(free);
  Listener made(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (made.descriptor_ < 0) return Fail(Code::Io, std::string("no socket to be had: ") + std::strerror(errno));
  if (bind(made.descriptor_, Generic(*address), sizeof(*address)) != 0) {
    return Fail(Code::Io, "cannot make the socket " + path + ": " + std::strerror(errno));
  }
  struct stat own{};
  if (lstat(path.c_str(), &own) == 0) made.own_ = {path, own.st_dev, own.st_ino};
  if (listen(made.descriptor_, SOMAXCONN) != 0) {
    return Fail(Code::Io, "cannot listen at " + path + ": " + std::strerror(errno));
  }
  return made;
}

Listener::Listener(Listener&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), own_(std::exchange(other.own_, {})) {}

void Listener::Remove() {
  struct stat found{};
  const Place own = std::exchange(own_, {});
  if (own.path.empty() || lstat(own.path.c_str(), &found) != 0) return;
  if (found.st_dev == own.device && found.st_ino == own.inode) unlink(own.path.c_str());
}

Listener::~Listener() {
  Remove();
  if (descriptor_ >= 0) close(descriptor_);
}

}  // namespace lensd::daemon
