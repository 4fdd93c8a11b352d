// The simulated USB camera attached to this kernel: requests in, descriptors, controls, pictures and status out, on one
// thread.
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

#include "sim/devices/uvc_camera.h"
#include "usbip.h"

namespace lensd::sim::devices {
namespace {

constexpr std::uint32_t kControlEndpoint = 0;
constexpr std::uint32_t kStream = UvcModel::kStreamEndpoint & 0x0F;
constexpr std::uint32_t kStatus = UvcModel::kStatusEndpoint & 0x0F;
constexpr int kTick_ms = 2;                                 // between looks at what has become due
constexpr Duration kIdle = std::chrono::milliseconds(500);  // without a reader the sensor stops

}  // namespace

/// The device's side of one connection at a time: a loop that answers what it can and keeps the rest.
class UvcCamera::Server {
 public:
  Server(std::unique_ptr<UvcModel> model, const Clock& clock)
      : clock_(clock), model_(std::move(model)), stream_(*model_), wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}
  ~Server() {
    Unplug();
    close(wake_);
  }

  Result<void> Plug() {
    const std::lock_guard plugging(plug_mutex_);
    if (thread_.joinable() && running_) return {};
    Join();
    auto socket = usbip::Attach();
    if (!socket) return PassOn(socket);
    socket_ = *socket;
    running_ = true;
    stop_ = false;
    model_->Reset();
    thread_ = std::thread([this] { Serve(); });
    return {};
  }

  void Unplug() {
    const std::lock_guard plugging(plug_mutex_);
    Join();
  }

  template <class Do>
  void WithModel(Do&& act) {
    const std::lock_guard lock(mutex_);
    act(*model_, stream_);
  }

  const std::shared_ptr<const Truth>& truth() const { return model_->truth(); }

 private:
  using Command = usbip::Command;
  struct Delayed {
    Instant due;
    Command command;
    std::vector<std::uint8_t> data;
  };
  struct Commands {
    std::deque<Command> pending;
    std::deque<Command> lost;
    std::deque<Delayed> delayed;
  };

  void Join() {
    if (!thread_.joinable()) return;
    stop_ = true;
    const std::uint64_t one = 1;
    (void)!write(wake_, &one, sizeof one);
    thread_.join();
  }

  void Serve() {
    while (!stop_ && Turn()) {
    }
    close(socket_);
    const std::lock_guard lock(mutex_);
    commands_.pending.clear();
    commands_.delayed.clear();
    commands_.lost.clear();
    stream_.Stop();
    running_ = false;
  }

  /// Takes one command if there is one and does what has become due. False: the connection is over.
  bool Turn() {
    pollfd waits[] = {{socket_, POLLIN, 0}, {wake_, POLLIN, 0}};
    poll(waits, 2, kTick_ms);
    if (waits[1].revents != 0) {
      std::uint64_t count = 0;
      (void)!read(wake_, &count, sizeof count);
    }
    if (stop_) return false;
    if (waits[0].revents != 0) {
      auto command = usbip::ReadCommand(socket_);
      if (!command) return false;
      const std::lock_guard lock(mutex_);
      if (!Take(*std::move(command))) return false;
    }
    const std::lock_guard lock(mutex_);
    return AnswerDelayed() && AnswerStatus() && AnswerStream();
  }

  bool Take(Command command) {
    if (command.unlink) return Unlink(command);
    if (command.endpoint == kControlEndpoint) return Control(std::move(command));
    commands_.pending.push_back(std::move(command));
    return true;
  }

  bool Unlink(const Command& command) {
    const auto is_it = [&](const Command& one) { return one.sequence == command.unlinked; };
    const bool found = std::erase_if(commands_.pending, is_it) + std::erase_if(commands_.lost, is_it) +
                           std::erase_if(commands_.delayed, [&](const Delayed& one) { return is_it(one.command); }) >
                       0;
    return usbip::AnswerUnlink(socket_, command, found).has_value();
  }

  bool Control(Command command) {
    auto answer = model_->Control(command.setup, command.out);
    switch (answer.kind) {
      case UvcModel::Answer::Kind::Stall:
        return usbip::Answer(socket_, command, usbip::kStalled, {}).has_value();
      case UvcModel::Answer::Kind::Lost:
        commands_.lost.push_back(std::move(command));
        return true;
      case UvcModel::Answer::Kind::Late:
        commands_.delayed.push_back(
            {clock_.Now() + model_->faults().delay, std::move(command), std::move(answer.data)});
        return true;
      case UvcModel::Answer::Kind::Done:
        break;
    }
    return usbip::Answer(socket_, command, 0, answer.data).has_value();
  }

  bool AnswerDelayed() {
    for (auto one = commands_.delayed.begin(); one != commands_.delayed.end();) {
      if (clock_.Now() < one->due) {
        ++one;
        continue;
      }
      if (!usbip::Answer(socket_, one->command, 0, one->data)) return false;
      one = commands_.delayed.erase(one);
    }
    return true;
  }

  std::deque<Command>::iterator Pending(std::uint32_t endpoint) {
    return std::ranges::find_if(commands_.pending, [&](const Command& one) { return one.endpoint == endpoint; });
  }

  bool AnswerStatus() {
    const auto waiting = Pending(kStatus);
    if (waiting == commands_.pending.end()) return true;
    const auto packets = model_->TakeStatus();
    if (packets.empty()) return true;
    const Command command = std::move(*waiting);
    commands_.pending.erase(waiting);
    return usbip::Answer(socket_, command, 0, packets.front()).has_value();
  }

  /// A transfer waits until there is something to send: no empty packets keep an emulated machine busy.
  bool AnswerStream() {
    auto waiting = Pending(kStream);
    if (waiting == commands_.pending.end()) {
      if (clock_.Now() - last_read_ > kIdle) stream_.Stop();
      return true;
    }
    for (; waiting != commands_.pending.end(); waiting = Pending(kStream)) {
      last_read_ = clock_.Now();
      std::vector<std::vector<std::uint8_t>> payloads;
      const std::size_t room = waiting->packet_lengths.empty() ? 1 : waiting->packet_lengths.size();
      const std::size_t most = waiting->packet_lengths.empty()
                                   ? std::min<std::size_t>(waiting->length, UvcModel::kBulkPayload)
                                   : waiting->packet_lengths.front();
      while (payloads.size() < room) {
        auto payload = stream_.Next(most);
        if (!payload || !*payload) break;
        payloads.push_back(**std::move(payload));
      }
      if (payloads.empty()) return true;
      const Command command = std::move(*waiting);
      commands_.pending.erase(waiting);
      const auto sent = command.packet_lengths.empty() ? usbip::Answer(socket_, command, 0, payloads.front())
                                                       : usbip::AnswerPackets(socket_, command, payloads);
      if (!sent) return false;
    }
    return true;
  }

  const Clock& clock_;
  std::mutex plug_mutex_;  ///< of the thread's life
  std::thread thread_;
  std::atomic<bool> stop_ = false;
  std::atomic<bool> running_ = false;

  std::mutex mutex_;  ///< of everything below, which the thread uses
  std::unique_ptr<UvcModel> model_;
  UvcStream stream_;
  Commands commands_;
  Instant last_read_{};
  int socket_ = -1;
  const int wake_;
};

Result<std::unique_ptr<UvcCamera>> UvcCamera::Create(std::shared_ptr<const Scene> scene, const Clock& clock,
                                                     const UvcOptions& options) {
  auto model = UvcModel::Create(std::move(scene), clock, options);
  if (!model) return PassOn(model);
  return std::unique_ptr<UvcCamera>(new UvcCamera(std::make_unique<Server>(*std::move(model), clock)));
}

UvcCamera::UvcCamera(std::unique_ptr<Server> server) : server_(std::move(server)) {}
UvcCamera::~UvcCamera() = default;

Result<void> UvcCamera::Plug() {
  return server_->Plug();
}
void UvcCamera::Unplug() {
  server_->Unplug();
}
void UvcCamera::SetFaults(const UvcFaults& faults) {
  server_->WithModel([&](UvcModel& model, UvcStream&) { model.faults() = faults; });
}
void UvcCamera::SetFaults(const StreamFaults& faults) {
  server_->WithModel([&](UvcModel&, UvcStream& stream) { stream.faults() = faults; });
}
void UvcCamera::Look(const std::function<void(UvcModel&)>& at) {
  server_->WithModel([&](UvcModel& model, UvcStream&) { at(model); });
}
const std::shared_ptr<const Truth>& UvcCamera::truth() const {
  return server_->truth();
}

}  // namespace lensd::sim::devices
