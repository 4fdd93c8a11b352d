// A datagram that asks for Alpaca devices is answered to its sender, with the port and nothing else: no sender can have
// this machine send more than was sent to it by much.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/epoll.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "web/alpaca/alpaca.h"

namespace lensd::web {
namespace {

constexpr int kDiscoveryPort = 32227;

}  // namespace

Result<std::unique_ptr<AlpacaDiscovery>> AlpacaDiscovery::Create(EventLoop& loop, int alpaca_port) {
  File socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const int on = 1;  // several servers of one machine share the port
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(kDiscoveryPort);
  if (socket.get() < 0 || setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) != 0 ||
      bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return Fail(Code::Io, std::string("Alpaca's discovery cannot listen at UDP 32227: ") + std::strerror(errno));
  }
  std::unique_ptr<AlpacaDiscovery> made(new AlpacaDiscovery(std::move(socket), alpaca_port));
  made->ready_ =
      loop.OnDescriptor(made->socket_.get(), EPOLLIN, [self = made.get()](std::uint32_t) { self->Respond(); });
  return made;
}

void AlpacaDiscovery::Respond() const {
  std::array<char, 64> asked{};
  sockaddr_in from{};
  socklen_t size = sizeof from;
  const ssize_t count =
      recvfrom(socket_.get(), asked.data(), asked.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
  if (count <= 0 || !std::string_view(asked.data(), static_cast<std::size_t>(count)).starts_with("alpacadiscovery1"))
    return;
  const std::string told = varlink::WriteJson({{"AlpacaPort", port_}});
  (void)sendto(socket_.get(), told.data(), told.size(), 0, reinterpret_cast<const sockaddr*>(&from), size);
}

}  // namespace lensd::web
