// Round trips without the daemon: a bare socket as the floor, sd-bus as a peer with the same text.
#include "bench/rpc/peers.h"

#include <sys/epoll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <systemd/sd-bus.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <optional>
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

/// Into the first `size` bytes of `buffer`.
bool ReceiveAll(int socket, std::vector<char>& buffer, std::size_t size) {
  if (buffer.size() < size) buffer.resize(size);
  for (std::size_t have = 0; have < size;) {
    const ssize_t got = ::recv(socket, buffer.data() + have, size - have, 0);
    if (got <= 0) return false;
    have += static_cast<std::size_t>(got);
  }
  return true;
}

/// A server in a process of its own, as the daemon is one: to wake another process costs more than another thread.
class ServerProcess {
 public:
  /// `serve` ends when the client's side is closed, and takes no memory that was not there before.
  template <class Serve>
  explicit ServerProcess(Serve serve) : process_(::fork()) {
    if (process_ != 0) return;
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    serve();
    ::_exit(0);
  }
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;
  ~ServerProcess() {
    if (process_ > 0) ::waitpid(process_, nullptr, 0);
  }

 private:
  const pid_t process_;
};

/// Answers over a pair of sockets.
class Echo {
 public:
  Echo(std::string request, std::string reply) : request_(std::move(request)), reply_(std::move(reply)) {}
  Echo(const Echo&) = delete;
  Echo& operator=(const Echo&) = delete;
  ~Echo() {
    ::shutdown(pair_[0], SHUT_RDWR);
    for (const int descriptor : pair_) ::close(descriptor);
  }
  bool Ask() { return SendAll(pair_[0], request_) && ReceiveAll(pair_[0], buffer_, reply_.size()); }

 private:
  void Serve() {
    while (ReceiveAll(pair_[1], buffer_, request_.size()) && SendAll(pair_[1], reply_)) {
    }
  }

  const std::string request_, reply_;
  const std::array<int, 2> pair_ = Pair();
  std::vector<char> buffer_ = std::vector<char>(std::max(request_.size(), reply_.size()));
  const ServerProcess server_{[this] { Serve(); }};
};

/// One client of a server that could have many.
class EpollServer {
 public:
  EpollServer(std::string request, std::string reply) : request_(std::move(request)), reply_(std::move(reply)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    // Abstract: in no folder.
    (void)std::snprintf(address.sun_path + 1, sizeof address.sun_path - 1, "lens-bench-%d", static_cast<int>(getpid()));
    const auto* generic = reinterpret_cast<const sockaddr*>(&address);
    good_ = ::bind(listening_, generic, sizeof address) == 0 && ::listen(listening_, 1) == 0 &&
            ::connect(client_, generic, sizeof address) == 0;
    Watch(listening_);
    server_.emplace([this] { Serve(); });
  }
  EpollServer(const EpollServer&) = delete;
  EpollServer& operator=(const EpollServer&) = delete;
  ~EpollServer() {
    ::shutdown(client_, SHUT_RDWR);
    ::shutdown(listening_, SHUT_RDWR);  // where nothing was ever accepted
    server_.reset();
    for (const int descriptor : {client_, listening_, epoll_}) ::close(descriptor);
  }
  bool Ask() { return good_ && SendAll(client_, request_) && ReceiveAll(client_, buffer_, reply_.size()); }

 private:
  void Watch(int descriptor) const {
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.fd = descriptor;
    ::epoll_ctl(epoll_, EPOLL_CTL_ADD, descriptor, &event);
  }
  void Serve() {
    std::size_t have = 0;
    for (;;) {
      epoll_event event{};
      if (::epoll_wait(epoll_, &event, 1, -1) < 1) continue;
      if (event.data.fd == listening_) {
        const int accepted = ::accept4(listening_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
        if (accepted < 0) return;
        Watch(accepted);
        continue;
      }
      const ssize_t got = ::recv(event.data.fd, buffer_.data(), buffer_.size(), MSG_DONTWAIT);
      if (got <= 0) {
        ::close(event.data.fd);
        return;
      }
      for (have += static_cast<std::size_t>(got); have >= request_.size(); have -= request_.size()) {
        SendAll(event.data.fd, reply_);
      }
    }
  }

  const std::string request_, reply_;
  const int epoll_ = ::epoll_create1(EPOLL_CLOEXEC);
  const int listening_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int client_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  std::vector<char> buffer_ = std::vector<char>(std::size_t{16} << 10);
  bool good_ = false;
  std::optional<ServerProcess> server_;
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
  return [echo] { return echo->Ask(); };
}

RoundTrip EpollEcho(std::string request, std::string reply) {
  auto server = std::make_shared<EpollServer>(std::move(request), std::move(reply));
  return [server] { return server->Ask(); };
}

RoundTrip SdBusCall(std::string request, std::string reply) {
  auto pair = std::make_shared<SdBusPair>(std::move(request), std::move(reply));
  return [pair] { return pair->Call(); };
}

}  // namespace lensd::bench
