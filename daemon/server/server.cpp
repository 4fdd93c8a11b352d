// Accepts clients up to a limit for all and for each user, and forgets them when they close.
#include "daemon/server/server.h"

#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "varlink/message.h"

namespace lensd::daemon {
namespace {

constexpr Duration kLongIdle = std::chrono::minutes(10);

}  // namespace

Result<std::unique_ptr<Server>> Server::Create(EventLoop& loop, int listening, const Router& router, Limits limits,
                                               std::string refusal, Notice notice) {
  std::unique_ptr<Server> made(new Server(loop, router, limits, std::move(refusal), std::move(notice)));
  sd_event_source* source = nullptr;
  int status = sd_event_add_io(loop.get(), &source, listening, EPOLLIN, OnAccept, made.get());
  made->source_.reset(source);
  const auto sweep = [](sd_event_source*, void* self) {
    static_cast<Server*>(self)->closed_.clear();
    return 0;
  };
  sd_event_source* sweeper = nullptr;
  if (status >= 0) status = sd_event_add_defer(loop.get(), &sweeper, sweep, made.get());
  made->sweep_.reset(sweeper);
  if (status < 0) return Fail(Code::Io, std::string("cannot watch the socket: ") + std::strerror(-status));
  sd_event_source_set_enabled(sweeper, SD_EVENT_OFF);
  return made;
}

Server::Server(EventLoop& loop, const Router& router, Limits limits, std::string refusal, Notice notice)
    : host_{loop,
            limits,
            [&router](const ExchangePointer& exchange) { router.Dispatch(exchange); },
            [&router](std::string_view message) { return router.ActsWhenRead(message); },
            {},
            0},
      router_(router),
      refusal_(std::move(refusal)),
      notice_(std::move(notice)) {}

Server::~Server() = default;

int Server::OnAccept(sd_event_source*, int listening, unsigned, void* self) {
  const int socket = accept4(listening, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (socket >= 0) static_cast<Server*>(self)->Take(socket);
  return 0;
}

std::size_t Server::Taken(Seat seat) const {
  return static_cast<std::size_t>(
      std::ranges::count_if(clients_, [&](const auto& client) { return client->seat() == seat; }));
}

/// None of the places that everybody shares is left for this user.
bool Server::Full(uid_t user) const {
  const auto own = std::ranges::count_if(
      clients_, [&](const auto& client) { return client->user() == user && client->seat() == Seat::Shared; });
  return Taken(Seat::Shared) >= host_.limits.connections ||
         static_cast<std::size_t>(own) >= host_.limits.user_connections;
}

/// Closes the connection of `user` on such a seat that has long been of no use, if there is one.
void Server::MakeRoom(Seat seat, uid_t user) {
  const Instant long_ago = MonotonicClock().Now() - kLongIdle;
  const auto idle = std::ranges::find_if(clients_, [&](const auto& client) {
    return client->seat() == seat && client->user() == user && client->idle() && client->last_read() < long_ago;
  });
  if (idle != clients_.end()) (*idle)->Close("idle for long, and others wait for its place");
}

/// A client that holds every place of its own, or all there are, keeps no administrator out, and none from stopping a
/// lens.
Server::Seat Server::SeatFor(const Credentials& client) {
  if (Full(client.user)) MakeRoom(Seat::Shared, client.user);
  if (!Full(client.user)) return Seat::Shared;
  if (router_.RoleOf(client) == Role::Administer) {
    const auto full = [&] { return Taken(Seat::Administrators) >= host_.limits.administrator_connections; };
    if (full()) MakeRoom(Seat::Administrators, client.user);
    if (!full()) return Seat::Administrators;
  }
  if (Taken(Seat::Stops) >= host_.limits.stop_connections) {
    const auto oldest = std::ranges::find_if(clients_, [](const auto& other) { return other->seat() == Seat::Stops; });
    (*oldest)->Close("");
  }
  return Seat::Stops;
}

void Server::Take(int socket) {
  Connection::Guest guest{.credentials = std::make_shared<const Credentials>(CredentialsOf(socket))};
  guest.seat = SeatFor(*guest.credentials);
  if (guest.seat == Seat::Stops) {
    const std::size_t most = std::min(host_.limits.connections, host_.limits.user_connections);
    guest.restriction = {refusal_, std::to_string(most) + " connections are open; try again later"};
    notice_("refused a client: all connections are taken");
  }
  auto made =
      Connection::Create(host_, socket, std::move(guest),
                         [this](Connection& connection, std::string_view reason) { Forget(connection, reason); });
  if (!made) return notice_(made.error().message);
  Connection& connection = **made;
  clients_.push_back(*std::move(made));
  connection.Start();
}

/// The connection is still on the call stack: it is destroyed when the loop comes round.
void Server::Forget(Connection& connection, std::string_view reason) {
  const auto found = std::ranges::find_if(clients_, [&](const auto& client) { return client.get() == &connection; });
  closed_.push_back(std::move(*found));
  clients_.erase(found);
  sd_event_source_set_enabled(sweep_.get(), SD_EVENT_ONESHOT);
  if (!reason.empty()) notice_("dropped a client: " + std::string(reason));
}

}  // namespace lensd::daemon
