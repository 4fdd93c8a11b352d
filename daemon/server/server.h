// Accepts clients and keeps them within limits.
#pragma once

#include <sys/types.h>

#include <functional>
#include <list>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/server/connection.h"
#include "daemon/server/router.h"
#include "loop/event_loop.h"

namespace lensd::daemon {

/// Event loop thread only.
class Server {
 public:
  /// Told what deserves a log line: a client dropped, refused.
  using Notice = std::function<void(std::string_view)>;

  /// Serves the listening socket, which must not block and must outlive the server, as all the others must. Clients
  /// beyond the limits may still make calls that act when they are read; others are answered `refusal` (an error's full
  /// name, with a message) and closed. Code::Io.
  static Result<std::unique_ptr<Server>> Create(EventLoop& loop, int listening, const Router& router, Limits limits,
                                                std::string refusal, Notice notice);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

 private:
  Server(EventLoop& loop, const Router& router, Limits limits, std::string refusal, Notice notice);
  static int OnAccept(sd_event_source* source, int descriptor, unsigned revents, void* self);
  using Seat = Connection::Seat;
  void Take(int socket);
  Seat SeatFor(const Credentials& client);
  bool Full(uid_t user) const;
  void MakeRoom(Seat seat, uid_t user);
  void Forget(Connection& connection, std::string_view reason);

  std::size_t Taken(Seat seat) const;

  ConnectionHost host_;
  const Router& router_;
  std::string refusal_;
  Notice notice_;
  EventSource source_;
  std::list<std::unique_ptr<Connection>> clients_;  // the longest there first
  std::vector<std::unique_ptr<Connection>> closed_;
  EventSource sweep_;
};

}  // namespace lensd::daemon
