// A question that is late counts from when it was due: a daemon that stalls is not forgiven what waited meanwhile.
#include "bench/rpc/open_loop.h"

#include <poll.h>
#include <sched.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <deque>
#include <memory>
#include <string>
#include <string_view>

#include "bench/rpc/private_daemon.h"

namespace lensd::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::string_view kQuestion("{\"method\":\"io.lensd.Lens.Status\"}\0", 34);
constexpr auto kInterval = std::chrono::milliseconds(1);
constexpr auto kPatience = std::chrono::seconds(20);

/// What this process and what it starts may run on, until destroyed.
class Pinned {
 public:
  Pinned() { sched_getaffinity(0, sizeof before_, &before_); }
  Pinned(const Pinned&) = delete;
  Pinned& operator=(const Pinned&) = delete;
  ~Pinned() { sched_setaffinity(0, sizeof before_, &before_); }
  enum class Part { First, Others };
  /// Nothing where there is one processor only.
  void To(Part part) const {
    cpu_set_t wanted = before_;
    int first = 0;
    while (first < CPU_SETSIZE && !CPU_ISSET(first, &before_)) ++first;
    if (CPU_COUNT(&before_) < 2) return;
    CPU_CLR(first, &wanted);
    if (part == Part::First) {
      CPU_ZERO(&wanted);
      CPU_SET(first, &wanted);
    }
    sched_setaffinity(0, sizeof wanted, &wanted);
  }

 private:
  cpu_set_t before_{};
};

class Asker {
 public:
  explicit Asker(const std::string& path) : socket_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    good_ = ::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  Asker(const Asker&) = delete;
  Asker& operator=(const Asker&) = delete;
  ~Asker() { ::close(socket_); }

  int socket() const { return socket_; }
  bool good() const { return good_; }
  void Ask(Clock::time_point due) {
    good_ = good_ && ::send(socket_, kQuestion.data(), kQuestion.size(), MSG_NOSIGNAL | MSG_DONTWAIT) ==
                         static_cast<ssize_t>(kQuestion.size());
    asked_.push_back(due);
  }
  /// What has come; how long each answer that is whole took.
  void Hear(std::vector<double>& us) {
    std::array<char, 65536> bytes;
    const ssize_t got = ::recv(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT);
    const auto now = Clock::now();
    for (ssize_t i = 0; i < got; ++i) {
      begins_well_ =
          begins_well_ && (at_ != 2 || bytes[static_cast<std::size_t>(i)] == 'p');  // {"parameters", not {"error"
      ++at_;
      if (bytes[static_cast<std::size_t>(i)] != '\0') continue;
      good_ = good_ && begins_well_ && !asked_.empty();
      if (!good_) return;
      us.push_back(std::chrono::duration<double, std::micro>(now - asked_.front()).count());
      asked_.pop_front();
      at_ = 0;
    }
    good_ = good_ && got > 0;
  }

 private:
  int socket_;
  bool good_ = false, begins_well_ = true;
  std::size_t at_ = 0;  // in the answer that comes
  std::deque<Clock::time_point> asked_;
};

}  // namespace

Result<std::vector<double>> AskAtRate(int lenses, int clients, int calls) {
  const Pinned pinned;
  pinned.To(Pinned::Part::Others);
  const auto daemon = PrivateDaemon::Start(lenses);
  pinned.To(Pinned::Part::First);
  if (!daemon) return PassOn(daemon);
  std::vector<std::unique_ptr<Asker>> askers;
  std::vector<pollfd> watched;
  for (int i = 0; i < clients; ++i) {
    askers.push_back(std::make_unique<Asker>((*daemon)->socket()));
    watched.push_back({askers.back()->socket(), POLLIN, 0});
  }
  std::vector<double> us;
  const auto began = Clock::now();
  int asked = 0;
  while (us.size() < static_cast<std::size_t>(calls)) {
    const auto now = Clock::now();
    for (; asked < calls && began + asked * kInterval <= now; ++asked) {
      askers[static_cast<std::size_t>(asked % clients)]->Ask(began + asked * kInterval);
    }
    const bool good = std::ranges::all_of(askers, [](const auto& asker) { return asker->good(); });
    if (!good || now > began + calls * kInterval + kPatience) {
      return Fail(Code::Protocol, "lensd did not answer every question for its status");
    }
    const auto left = asked < calls ? began + asked * kInterval - Clock::now() : Clock::duration(kInterval);
    const timespec wait{0, std::max<long>(0, std::chrono::duration_cast<std::chrono::nanoseconds>(left).count())};
    if (::ppoll(watched.data(), watched.size(), &wait, nullptr) <= 0) continue;
    for (std::size_t i = 0; i < watched.size(); ++i) {
      if (watched[i].revents != 0) askers[i]->Hear(us);
    }
  }
  return us;
}

}  // namespace lensd::bench
