// HTTP/1.1 by libmicrohttpd, driven from the event loop; bounded in connections and in the time a request may take.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "base/clock.h"
#include "base/result.h"
#include "loop/web_event_loop.h"
#include "web/exchange.h"

struct MHD_Daemon;

namespace lensd::web {

/// A listening TCP socket.
struct Endpoint {
  int descriptor = -1;  ///< belongs to the server that listens with it
  std::string address;  ///< numeric
  int port = 0;
  bool loopback = false;
};

/// Systemd's socket where it passed one, else one bound to "ADDRESS:PORT" ("[::1]:8480", port 0: any that is free).
/// Code::InvalidArgument: that is no address; Code::Io: it cannot be listened at.
Result<Endpoint> Listen(const std::string& where);

/// Serves until destroyed. Event loop thread only.
class HttpServer {
 public:
  /// Looks at the head of a request; an answer refuses it before its body is read.
  using Gate = std::function<std::optional<Answer>(const Exchange&)>;
  /// Answers a whole request, now or later.
  using Handler = std::function<void(Exchange&)>;

  static Result<std::unique_ptr<HttpServer>> Create(EventLoop& loop, const Endpoint& endpoint, Gate gate,
                                                    Handler handler);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  std::size_t connections() const { return connections_.size(); }

 private:
  struct Glue;  // what libmicrohttpd calls
  struct Connection {
    int descriptor = -1;
    std::optional<Instant> waiting_since{};  ///< for a request; none while one is being answered
  };
  HttpServer(EventLoop& loop, Gate gate, Handler handler);
  void Turn();
  void TurnSoon();
  void Opened(const void* connection, int descriptor);
  void CloseLate();

  const ServerFloor floor_;
  const Gate gate_;
  const Handler handler_;
  MHD_Daemon* daemon_ = nullptr;
  Watch ready_, due_, soon_, late_;
  std::map<const void*, Connection> connections_;
  std::map<const Exchange*, std::unique_ptr<Exchange>> exchanges_;
};

}  // namespace lensd::web
