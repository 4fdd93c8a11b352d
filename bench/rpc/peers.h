// Round trips without the daemon: the floor, and another protocol with the same text.
#pragma once

#include <functional>
#include <memory>
#include <string>

namespace lensd::bench {

/// One round trip; false when it failed.
using RoundTrip = std::function<bool()>;

/// A process that answers `reply` to every message of `request`'s length, over a pair of sockets: no daemon can be
/// faster.
RoundTrip SocketEcho(std::string request, std::string reply);

/// The same by a server as a daemon has to be one: it listens, waits by epoll and reads without waiting.
RoundTrip EpollEcho(std::string request, std::string reply);

/// The same two texts as argument and result of a D-Bus method, from sd-bus to sd-bus without a bus in between.
RoundTrip SdBusCall(std::string request, std::string reply);

}  // namespace lensd::bench
