#include "server.h"

#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "proto/message.h"

namespace lensd::daemon {

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
    : loop_(loop), router_(router), limits_(limits), refusal_(std::move(refusal)), notice_(std::move(notice)) {}

Server::~Server() = default;

int Server::OnAccept(sd_event_source*, int listening, unsigned, void* self) {
  const int socket = accept4(listening, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (socket >= 0) static_cast<Server*>(self)->Take(socket);
  return 0;
}

void Server::Take(int socket) {
  if (connections_.size() >= limits_.connections) {
    proto::Reply refused;
    refused.error = refusal_;
    refused.parameters = {{"message", std::to_string(limits_.connections) + " connections are open; try again later"}};
    const std::string message = proto::EncodeReply(refused);
    (void)!send(socket, message.data(), message.size(), MSG_NOSIGNAL);
    close(socket);
    return notice_("refused a client: all connections are taken");
  }
  auto made = Connection::Create(
      loop_, socket, limits_, [this](const ExchangePointer& exchange) { router_.Dispatch(exchange); },
      [this](Connection& connection, std::string_view reason) { Forget(connection, reason); });
  if (!made) return notice_(made.error().message);
  Connection* const key = made->get();
  connections_.emplace(key, *std::move(made));
}

/// The connection is still on the call stack: it is destroyed when the loop comes round.
void Server::Forget(Connection& connection, std::string_view reason) {
  const auto found = connections_.find(&connection);
  closed_.push_back(std::move(found->second));
  connections_.erase(found);
  sd_event_source_set_enabled(sweep_.get(), SD_EVENT_ONESHOT);
  if (!reason.empty()) notice_("dropped a client: " + std::string(reason));
}

}  // namespace lensd::daemon
