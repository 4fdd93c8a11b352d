// Where browsers find us: systemd's socket, or one of our own.
#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>

#include "web/http_server.h"

namespace lensd::web {
namespace {

struct Address {
  sockaddr_storage bytes{};
  socklen_t size = 0;
  const sockaddr* generic() const { return reinterpret_cast<const sockaddr*>(&bytes); }
};

Result<Address> AddressOf(const std::string& where) {
  const auto wrong = [&] {
    return Fail(Code::InvalidArgument, "\"" + where + "\" is no place to listen at: say 127.0.0.1:8480 or [::1]:8480");
  };
  const std::size_t colon = where.rfind(':');
  if (colon == std::string::npos) return wrong();
  std::uint16_t port = 0;
  const auto parsed = std::from_chars(where.data() + colon + 1, where.data() + where.size(), port);
  if (parsed.ec != std::errc{} || parsed.ptr != where.data() + where.size()) return wrong();
  Address address;
  if (where.front() == '[' && colon >= 2 && where[colon - 1] == ']') {
    auto& six = reinterpret_cast<sockaddr_in6&>(address.bytes);
    six.sin6_family = AF_INET6;
    six.sin6_port = htons(port);
    address.size = sizeof(six);
    if (inet_pton(AF_INET6, where.substr(1, colon - 2).c_str(), &six.sin6_addr) != 1) return wrong();
    return address;
  }
  auto& four = reinterpret_cast<sockaddr_in&>(address.bytes);
  four.sin_family = AF_INET;
  four.sin_port = htons(port);
  address.size = sizeof(four);
  if (inet_pton(AF_INET, where.substr(0, colon).c_str(), &four.sin_addr) != 1) return wrong();
  return address;
}

/// What the kernel says the socket is bound to.
Result<Endpoint> Described(int descriptor) {
  Address address;
  address.size = sizeof(address.bytes);
  if (getsockname(descriptor, reinterpret_cast<sockaddr*>(&address.bytes), &address.size) != 0) {
    return Fail(Code::Io, std::string("the listening socket has no address: ") + std::strerror(errno));
  }
  char text[INET6_ADDRSTRLEN] = "";
  Endpoint endpoint{.descriptor = descriptor, .address = {}};
  if (address.bytes.ss_family == AF_INET6) {
    const auto& six = reinterpret_cast<const sockaddr_in6&>(address.bytes);
    inet_ntop(AF_INET6, &six.sin6_addr, text, sizeof text);
    endpoint.port = ntohs(six.sin6_port);
    endpoint.loopback = IN6_IS_ADDR_LOOPBACK(&six.sin6_addr);
    endpoint.address = "[" + std::string(text) + "]";
  } else {
    const auto& four = reinterpret_cast<const sockaddr_in&>(address.bytes);
    inet_ntop(AF_INET, &four.sin_addr, text, sizeof text);
    endpoint.port = ntohs(four.sin_port);
    endpoint.loopback = (ntohl(four.sin_addr.s_addr) >> 24) == 127;
    endpoint.address = text;
  }
  return endpoint;
}

}  // namespace

Result<Endpoint> Listen(const std::string& where) {
  if (sd_listen_fds(/*unset_environment=*/1) > 0) {
    const int passed = SD_LISTEN_FDS_START;
    const bool tcp =
        sd_is_socket(passed, AF_INET, SOCK_STREAM, 1) > 0 || sd_is_socket(passed, AF_INET6, SOCK_STREAM, 1) > 0;
    if (!tcp) return Fail(Code::InvalidArgument, "systemd must pass a listening TCP socket; see lens-web.socket");
    fcntl(passed, F_SETFL, fcntl(passed, F_GETFL) | O_NONBLOCK);
    return Described(passed);
  }
  const auto address = AddressOf(where);
  if (!address) return PassOn(address);
  const int made = socket(address->bytes.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const int on = 1;
  if (made < 0 || setsockopt(made, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) != 0 ||
      bind(made, address->generic(), address->size) != 0 || listen(made, SOMAXCONN) != 0) {
    const int why = errno;
    if (made >= 0) close(made);
    return Fail(Code::Io, "cannot listen at " + where + ": " + std::strerror(why));
  }
  return Described(made);
}

}  // namespace lensd::web
