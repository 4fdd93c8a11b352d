// One thread accepts connections and watches for their ends, so that it notices the end of lensd while a call hangs.
#include "drivers/host/host.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sysexits.h>
#include <unistd.h>

#include <atomic>
#include <charconv>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <list>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "confinement.h"
#include "proto/driver_interface.h"
#include "session.h"

namespace lensd::drivers::host {
namespace {

constexpr int kFirstDescriptor = 3;  // where systemd's protocol begins
constexpr int kThrew = 70;

/// What a thread needs after Serve() has returned: it may still hang in the driver.
struct Shared {
  Shared(const Driver& driver, const Clock& clock, varlink::InterfaceDefinition interface)
      : devices(driver, clock), definition(std::move(interface)), wake(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}
  OpenDevices devices;
  const varlink::InterfaceDefinition definition;
  const daemon::Descriptor wake;
  std::atomic<bool> threw{false};
};

class Connections {
 public:
  Connections(std::shared_ptr<Shared> shared, daemon::Descriptor listening)
      : shared_(std::move(shared)), listening_(std::move(listening)) {
    fcntl(listening_.get(), F_SETFL, fcntl(listening_.get(), F_GETFL) | O_NONBLOCK);
  }

  /// Until the last one has ended, or a call threw.
  void Watch() {
    bool any = false;
    while (!shared_->threw && !(any && watched_.empty())) {
      std::vector<pollfd> waits{{listening_.get(), POLLIN, 0}, {shared_->wake.get(), POLLIN, 0}};
      for (const auto& session : watched_) waits.push_back({session->descriptor(), POLLRDHUP, 0});
      if (poll(waits.data(), waits.size(), -1) < 0) continue;
      eventfd_t unused = 0;
      eventfd_read(shared_->wake.get(), &unused);
      // All connections that wait are taken before it is judged whether the last one has ended.
      std::size_t index = 2;
      for (auto one = watched_.begin(); one != watched_.end(); ++index) {
        const bool gone = waits[index].revents != 0;
        if (gone) (*one)->OtherSideIsGone();
        one = gone ? watched_.erase(one) : std::next(one);
      }
      any = AcceptAll() || any;
    }
  }

 private:
  bool AcceptAll() {
    bool any = false;
    for (;;) {
      daemon::Descriptor socket(accept4(listening_.get(), nullptr, nullptr, SOCK_CLOEXEC));
      if (!socket) return any;
      any = true;
      auto session = std::make_shared<Session>(std::move(socket), shared_->devices, shared_->definition);
      watched_.push_back(session);
      std::thread([shared = shared_, session = std::move(session)] {
        try {
          session->Run();
        } catch (...) {
          shared->threw = true;  // it has been printed
        }
        shutdown(session->descriptor(), SHUT_RDWR);  // seen by Watch(), and by the other side
        eventfd_write(shared->wake.get(), 1);
      }).detach();
    }
  }

  std::shared_ptr<Shared> shared_;
  daemon::Descriptor listening_;
  std::list<std::shared_ptr<Session>> watched_;
};

Result<daemon::Descriptor> InheritedSocket() {
  const auto number = [](const char* name) {
    const char* text = std::getenv(name);
    long value = -1;
    if (text != nullptr) std::from_chars(text, text + std::strlen(text), value);
    return value;
  };
  if (number("LISTEN_PID") != getpid() || number("LISTEN_FDS") != 1) {
    return Fail(Code::InvalidArgument,
                "lensd starts this program, and passes a listening socket to it (LISTEN_FDS=1, "
                "LISTEN_PID); it cannot be run by hand");
  }
  for (const char* name : {"LISTEN_PID", "LISTEN_FDS", "LISTEN_FDNAMES"}) unsetenv(name);
  fcntl(kFirstDescriptor, F_SETFD, FD_CLOEXEC);
  return daemon::Descriptor(kFirstDescriptor);
}

/// Whoever ends lensd by these signals may send them to all its processes. lensd then parks what moves and closes its
/// devices in order, which needs this process.
void LeaveSignalsToLensd() {
  for (const int one : {SIGPIPE, SIGTERM, SIGINT, SIGHUP}) signal(one, SIG_IGN);
}

/// The exit status.
int Serve(const Driver& driver, daemon::Descriptor listening, const Clock& clock) {
  auto definition = varlink::InterfaceDefinition::Parse(proto::DriverInterfaceText());
  if (!definition) return kThrew;
  const auto shared = std::make_shared<Shared>(driver, clock, *std::move(definition));
  Connections(shared, std::move(listening)).Watch();
  struct Closing {
    std::mutex mutex;
    std::condition_variable changed;
    bool done = false;
  };
  const auto closing = std::make_shared<Closing>();
  std::thread([shared, closing] {
    try {
      shared->devices.CloseAll();
    } catch (...) {
      shared->threw = true;
    }
    const std::lock_guard lock(closing->mutex);
    closing->done = true;
    closing->changed.notify_all();
  }).detach();
  std::unique_lock lock(closing->mutex);
  closing->changed.wait_for(lock, kCloseAtMost, [&] { return closing->done; });
  return shared->threw ? kThrew : 0;
}

}  // namespace

void RunHost(const Driver& driver, const Confinement& confinement) {
  static const MonotonicClock clock;
  auto listening = InheritedSocket();
  if (!listening) {
    std::fprintf(stderr, "%s\n", listening.error().message.c_str());
    std::exit(EX_USAGE);
  }
  LeaveSignalsToLensd();
  setvbuf(stdout, nullptr, _IOLBF, 0);
  Confine(confinement);
  const int status = Serve(driver, *std::move(listening), clock);
  std::fflush(nullptr);
  _exit(status);  // a call that hangs in the driver is not waited for
}

}  // namespace lensd::drivers::host
