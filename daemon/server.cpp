// Accepts clients up to a limit for all and for each user, and forgets them when they close.
#include "server.h"

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
      refusal_(std::move(refusal)),
      notice_(std::move(notice)) {}

Server::~Server() = default;

int Server::OnAccept(sd_event_source*, int listening, unsigned, void* self) {
  const int socket = accept4(listening, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (socket >= 0) static_cast<Server*>(self)->Take(socket);
  return 0;
}

std::size_t Server::CountOf(uid_t user) const {
  return static_cast<std::size_t>(std::ranges::count_if(
      clients_, [&](const auto& client) { return client->user() == user && !client->restricted(); }));
}

/// Closes the connection of `user` that has long been of no use, if there is one; and of those for stops the oldest.
void Server::MakeRoom(uid_t user) {
  const Instant long_ago = MonotonicClock().Now() - kLongIdle;
  const auto idle = std::ranges::find_if(clients_, [&](const auto& client) {
    return client->user() == user && client->idle() && client->last_read() < long_ago;
  });
  if (idle != clients_.end()) return (*idle)->Close("idle for long, and others wait for its place");
  const auto restricted = [](const auto& client) { return client->restricted(); };
  if (static_cast<std::size_t>(std::ranges::count_if(clients_, restricted)) < host_.limits.stop_connections) return;
  std::ranges::find_if(clients_, restricted)->get()->Close("");
}

void Server::Take(int socket) {
  Connection::Guest guest{std::make_shared<const Credentials>(CredentialsOf(socket))};
  const uid_t user = guest.credentials->user;
  const auto full = [&] {
    return clients_.size() >= host_.limits.connections || CountOf(user) >= host_.limits.user_connections;
  };
  if (full()) MakeRoom(user);
  if (full()) {
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
