// libmicrohttpd has an epoll of its own, which becomes readable when it has something to do; then it takes one turn.
// Its own timeout forgives a client that sends a byte now and then, so the time for a whole request is kept here.
#include "web/http_server.h"

#include <microhttpd.h>
#include <sys/epoll.h>
#include <sys/socket.h>

#include <algorithm>
#include <chrono>

namespace lensd::web {
namespace {

using std::chrono::seconds;
constexpr unsigned kMostConnections = 256;
// From here on a client that has asked for nothing yet makes room for the next one: a Stop always comes through.
constexpr std::size_t kCrowded = 192;
constexpr Duration kTimeForRequest = seconds(20);
constexpr unsigned kUnreadSeconds = 30;  // a client that takes nothing is let go
constexpr std::size_t kMemoryOfConnection = 65536;

}  // namespace

struct HttpServer::Glue {
  static MHD_Result Handle(void* self, MHD_Connection* connection, const char* url, const char* method, const char*,
                           const char* upload, std::size_t* upload_size, void** known) {
    auto& server = *static_cast<HttpServer*>(self);
    if (*known == nullptr) return Begin(server, connection, url, method, known);
    auto& exchange = *static_cast<Exchange*>(*known);
    if (*upload_size > 0) {
      const bool taken = exchange.Take({upload, *upload_size});
      *upload_size = 0;
      return taken ? MHD_YES : MHD_NO;
    }
    auto& waiting = server.connections_[connection].waiting_since;
    if (waiting) {
      waiting.reset();
      server.handler_(exchange);
    }
    return exchange.Go() ? MHD_YES : MHD_NO;
  }

  static MHD_Result Begin(HttpServer& server, MHD_Connection* connection, const char* url, const char* method,
                          void** known) {
    auto made = std::make_unique<Exchange>(server.floor_, connection, method, url);
    Exchange& exchange = *made;
    *known = &exchange;
    server.exchanges_[&exchange] = std::move(made);
    const auto refused = server.gate_(exchange);
    if (!refused) return MHD_YES;
    exchange.Reply(*refused);
    return exchange.Go() ? MHD_YES : MHD_NO;
  }

  static void Completed(void* self, MHD_Connection* connection, void** known, MHD_RequestTerminationCode) {
    auto& server = *static_cast<HttpServer*>(self);
    server.exchanges_.erase(static_cast<const Exchange*>(*known));
    *known = nullptr;
    const auto found = server.connections_.find(connection);
    if (found != server.connections_.end()) found->second.waiting_since = MonotonicClock().Now();
  }

  static void Notify(void* self, MHD_Connection* connection, void**, MHD_ConnectionNotificationCode what) {
    auto& server = *static_cast<HttpServer*>(self);
    if (what == MHD_CONNECTION_NOTIFY_CLOSED) {
      server.connections_.erase(connection);
      return;
    }
    server.Opened(connection, MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD)->connect_fd);
  }

  /// Paths and values are C strings to libmicrohttpd: a zero byte that is written as %00 would end them, and "/%00" be
  /// "/".
  static std::size_t Unescape(void*, MHD_Connection*, char* text) {
    const std::size_t size = MHD_http_unescape(text);
    std::replace(text, text + size, '\0', '\1');
    return size;
  }

  static void Ignore(void*, const char*, va_list) {}
};

HttpServer::HttpServer(EventLoop& loop, Gate gate, Handler handler)
    : floor_{loop, [this] { TurnSoon(); }}, gate_(std::move(gate)), handler_(std::move(handler)) {}

Result<std::unique_ptr<HttpServer>> HttpServer::Create(EventLoop& loop, const Endpoint& endpoint, Gate gate,
                                                       Handler handler) {
  std::unique_ptr<HttpServer> server(new HttpServer(loop, std::move(gate), std::move(handler)));
  server->daemon_ = MHD_start_daemon(MHD_USE_EPOLL | MHD_ALLOW_SUSPEND_RESUME | MHD_USE_ERROR_LOG, 0, nullptr, nullptr,
                                     &Glue::Handle, server.get(), MHD_OPTION_EXTERNAL_LOGGER, &Glue::Ignore, nullptr,
                                     MHD_OPTION_UNESCAPE_CALLBACK, &Glue::Unescape, nullptr, MHD_OPTION_LISTEN_SOCKET,
                                     endpoint.descriptor, MHD_OPTION_CONNECTION_LIMIT, kMostConnections,
                                     MHD_OPTION_CONNECTION_TIMEOUT, kUnreadSeconds, MHD_OPTION_CONNECTION_MEMORY_LIMIT,
                                     kMemoryOfConnection, MHD_OPTION_NOTIFY_COMPLETED, &Glue::Completed, server.get(),
                                     MHD_OPTION_NOTIFY_CONNECTION, &Glue::Notify, server.get(), MHD_OPTION_END);
  if (server->daemon_ == nullptr) return Fail(Code::Io, "libmicrohttpd does not take the listening socket");
  const int epoll = MHD_get_daemon_info(server->daemon_, MHD_DAEMON_INFO_EPOLL_FD)->epoll_fd;
  server->ready_ = loop.OnDescriptor(epoll, EPOLLIN, [self = server.get()](std::uint32_t) { self->Turn(); });
  return server;
}

HttpServer::~HttpServer() {
  if (daemon_ == nullptr) return;
  ready_.reset();
  // libmicrohttpd wants every connection awake before it ends; Refusal() does nothing where an answer has begun.
  for (const auto& entry : exchanges_) {
    entry.second->Reply(Refusal(503, "Ending", "lens-web is ending"));
    entry.second->Wake();
  }
  MHD_stop_daemon(daemon_);
}

/// Without a thread of its own libmicrohttpd does not tell its epoll of connections that were woken.
void HttpServer::TurnSoon() {
  if (!soon_) soon_ = floor_.loop.Soon([this] { Turn(); });
}

void HttpServer::Turn() {
  soon_.reset();
  MHD_run(daemon_);
  MHD_UNSIGNED_LONG_LONG due_ms = 0;
  due_.reset();
  if (MHD_get_timeout(daemon_, &due_ms) != MHD_YES) return;
  if (due_ms == 0) return TurnSoon();
  due_ = floor_.loop.After(std::chrono::milliseconds(due_ms), [this] { Turn(); });
}

void HttpServer::Opened(const void* connection, int descriptor) {
  connections_[connection] = {descriptor, MonotonicClock().Now()};
  if (connections_.size() > kCrowded) {
    const auto older = [](const auto& one, const auto& other) {
      const Instant never = Instant::max();
      return one.second.waiting_since.value_or(never) < other.second.waiting_since.value_or(never);
    };
    const auto oldest = std::ranges::min_element(connections_, older);
    if (oldest->second.waiting_since) shutdown(oldest->second.descriptor, SHUT_RDWR);
  }
  if (!late_) CloseLate();
}

void HttpServer::CloseLate() {
  const Instant now = MonotonicClock().Now();
  for (const auto& entry : connections_) {
    const auto& since = entry.second.waiting_since;
    if (since && now - *since > kTimeForRequest) shutdown(entry.second.descriptor, SHUT_RDWR);
  }
  late_.reset();
  if (!connections_.empty()) late_ = floor_.loop.After(seconds(1), [this] { CloseLate(); });
}

}  // namespace lensd::web
