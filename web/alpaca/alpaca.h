// ASCOM Alpaca: every lens with a focus motor as a focuser, for programs of astronomers on other machines.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "varlink/json.h"
#include "web/alpaca/alpaca_move.h"
#include "web/exchange.h"
#include "web/link/lensd_link.h"

namespace lensd::web {

/// The device API, version 1: management and focusers (interface 4). Has no tokens, as the protocol has none.
class Alpaca {
 public:
  explicit Alpaca(const LensdLink& link) : link_(link) {}

  /// Refuses pages of other sites: programs send no Origin.
  static std::optional<Answer> Gate(const Exchange& exchange);
  void Handle(Exchange& exchange);

 private:
  friend class AlpacaRequest;
  struct Focuser {
    std::deque<std::uint32_t> clients{};  ///< by ClientID, that are connected; the one longest so first
    std::unique_ptr<AlpacaMove> move{};   ///< the last one that was asked for
  };
  const LensdLink& link_;
  std::map<std::string, Focuser> focusers_;  // by lens
  unsigned transactions_ = 0;
};

/// Answers broadcasts of those who look for Alpaca devices with the port, and nothing else.
class AlpacaDiscovery {
 public:
  /// Code::Io: the port of discovery cannot be had.
  static Result<std::unique_ptr<AlpacaDiscovery>> Create(EventLoop& loop, int alpaca_port);

 private:
  AlpacaDiscovery(File socket, int alpaca_port) : socket_(std::move(socket)), port_(alpaca_port) {}
  void Respond() const;

  const File socket_;
  const int port_;
  Watch ready_;
};

}  // namespace lensd::web
