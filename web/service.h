// What lens-web answers: /call/METHOD, /events, /history, /live.mjpg, /snapshot.png, /metrics, /session and the page.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "web/access.h"
#include "web/event_feed.h"
#include "web/exchange.h"
#include "web/link/lensd_link.h"
#include "web/live_view.h"
#include "web/seats.h"

namespace lensd::web {

/// Event loop thread only.
class Service {
 public:
  Service(const LensdLink& link, Access access);

  /// By the head of a request alone.
  std::optional<Answer> Gate(const Exchange& exchange) const;
  void Handle(Exchange& exchange);
  /// How many connections there are, for /metrics.
  void CountConnections(std::function<std::size_t()> count) { connections_ = std::move(count); }

 private:
  /// False: there is none left, and the client has been told so.
  bool Seated(Exchange& exchange, Seats& seats, const char* what) const;

  void Get(Exchange& exchange);
  void Session(Exchange& exchange) const;
  void Call(Exchange& exchange);
  void Begin(Exchange& exchange, const std::string& method, varlink::Json parameters);
  void Snapshot(Exchange& exchange);
  void Metrics(Exchange& exchange);
  void Stream(Exchange& exchange);

  const LensdLink& link_;
  const Access access_;
  LiveViews views_;
  EventFeed feed_;
  std::function<std::size_t()> connections_;
  Seats streams_, calls_;
};

}  // namespace lensd::web
