// Round trips without the daemon: a bare socket as the floor, sd-bus as a peer with the same text.
#include "bench/rpc/peers.h"

#include <sys/socket.h>
#include <systemd/sd-bus.h>
#include <unistd.h>

#include <array>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

namespace lensd::bench {
namespace {

/// Two connected sockets.
std::array<int, 2> Pair() {
  std::array<int, 2> pair{-1, -1};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair.data()) != 0) pair = {-1, -1};
  return pair;
}

bool SendAll(int socket, std::string_view data) {
  while (!data.empty()) {
    const ssize_t sent = ::send(socket, data.data(), data.size(), MSG_NOSIGNAL);
    if (sent <= 0) return false;
    data.remove_prefix(static_cast<std::size_t>(sent));
  }
  return true;
}

bool ReceiveAll(int socket, std::size_t size) {
  std::vector<char> buffer(size);
  for (std::size_t have = 0; have < size;) {
    const ssize_t got = ::recv(socket, buffer.data() + have, size - have, 0);
    if (got <= 0) return false;
    have += static_cast<std::size_t>(got);
  }
  return true;
}

/// Ends when the client's side is closed.
struct Echo {
  Echo(std::string asked, std::string answered) : request(std::move(asked)), reply(std::move(answered)) {
    server = std::thread([this] {
      while (ReceiveAll(pair[1], request.size()) && SendAll(pair[1], reply)) {
      }
    });
  }
  Echo(const Echo&) = delete;
  Echo& operator=(const Echo&) = delete;
  ~Echo() {
    ::shutdown(pair[0], SHUT_RDWR);
    server.join();
    ::close(pair[0]);
    ::close(pair[1]);
  }

  const std::string request, reply;
  const std::array<int, 2> pair = Pair();
  std::thread server;
};

constexpr const char* kPath = "/lens";
constexpr const char* kInterface = "io.lensd.Lens";

class SdBusPair {
 public:
  SdBusPair(std::string request, std::string reply) : request_(std::move(request)), reply_(std::move(reply)) {
    server_ = std::thread([this] { Serve(); });
    sd_bus_new(&client_);
    sd_bus_set_fd(client_, pair_[0], pair_[0]);
    sd_bus_start(client_);
  }
  SdBusPair(const SdBusPair&) = delete;
  SdBusPair& operator=(const SdBusPair&) = delete;
  ~SdBusPair() {
    sd_bus_close(client_);
    server_.join();
    sd_bus_unref(client_);
  }

  bool Call() {
    sd_bus_message* answer = nullptr;
    const char* text = nullptr;
    const int called =
        sd_bus_call_method(client_, nullptr, kPath, kInterface, "Plan", nullptr, &answer, "s", request_.c_str());
    const bool good = called >= 0 && sd_bus_message_read(answer, "s", &text) > 0 && reply_ == text;
    sd_bus_message_unref(answer);
    return good;
  }

 private:
  static int Answer(sd_bus_message* message, void* pair, sd_bus_error*) {
    const char* text = nullptr;
    if (!sd_bus_message_is_method_call(message, kInterface, "Plan")) return 0;
    if (sd_bus_message_read(message, "s", &text) <= 0) return 0;
    return sd_bus_reply_method_return(message, "s", static_cast<SdBusPair*>(pair)->reply_.c_str());
  }

  void Serve() {
    sd_bus* bus = nullptr;
    sd_id128_t id;
    sd_id128_randomize(&id);
    sd_bus_new(&bus);
    sd_bus_set_fd(bus, pair_[1], pair_[1]);
    sd_bus_set_server(bus, 1, id);
    sd_bus_add_object(bus, nullptr, kPath, Answer, this);
    int state = sd_bus_start(bus);
    while (state >= 0) {
      state = sd_bus_process(bus, nullptr);
      if (state == 0) state = sd_bus_wait(bus, UINT64_MAX);
    }
    sd_bus_flush_close_unref(bus);
  }

  const std::string request_, reply_;
  const std::array<int, 2> pair_ = Pair();
  sd_bus* client_ = nullptr;
  std::thread server_;
};

}  // namespace

RoundTrip SocketEcho(std::string request, std::string reply) {
  auto echo = std::make_shared<Echo>(std::move(request), std::move(reply));
  return [echo] { return SendAll(echo->pair[0], echo->request) && ReceiveAll(echo->pair[0], echo->reply.size()); };
}

RoundTrip SdBusCall(std::string request, std::string reply) {
  auto pair = std::make_shared<SdBusPair>(std::move(request), std::move(reply));
  return [pair] { return pair->Call(); };
}

}  // namespace lensd::bench
