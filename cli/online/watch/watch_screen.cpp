// Three things wait for the daemon, each on a thread and a connection of its own: states, the sharpness of the chosen
// lens, and what a key has asked for. The screen itself never waits.
#include "cli/online/watch/watch_screen.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>

#include "cli/link/daemon_client.h"
#include "cli/online/watch/watch_lines.h"
#include "cli/terminal/terminal.h"
#include "cli/text/texts.h"
#include "proto/interfaces.h"
#include "varlink/client.h"

namespace lensd::cli {
namespace {

using varlink::Json;

constexpr Duration kScreenRedrawEvery = std::chrono::milliseconds(50);
constexpr Duration kLeaseTick = std::chrono::seconds(1);  ///< what is left of a lease goes on by itself

/// A call on a thread of its own, which ends with this object.
class BackgroundCall {
 public:
  using Take = std::function<void(const Result<varlink::Reply>&)>;
  /// `take` is called on that thread with every reply, and with what ended the call if that is no reply.
  BackgroundCall(std::string socket, varlink::Call call, Take take)
      : stop_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
        thread_([this, socket = std::move(socket), call = std::move(call), take = std::move(take)] {
          Run(socket, call, take);
          ended_ = true;
        }) {}
  ~BackgroundCall() {
    eventfd_write(stop_, 1);
    thread_.join();
    close(stop_);
  }
  BackgroundCall(const BackgroundCall&) = delete;
  BackgroundCall& operator=(const BackgroundCall&) = delete;
  bool ended() const { return ended_; }

 private:
  void Run(const std::string& socket, const varlink::Call& call, const Take& take) const {
    auto client = varlink::Client::Connect(socket);
    if (!client) return take(PassOn(client));
    client->SetInterrupt(stop_);
    if (auto sent = client->Send(call); !sent) return take(PassOn(sent));
    for (;;) {
      const auto reply = client->Receive();
      take(reply);
      if (!reply || !reply->continues) return;
    }
  }

  int stop_;
  std::atomic<bool> ended_ = false;
  std::thread thread_;  // last: it uses the others
};

varlink::Call CallOf(std::string_view method, Json parameters, bool more) {
  varlink::Call call;
  call.method = MethodOfLens(method);
  call.parameters = WithLease(call.method, std::move(parameters));
  call.more = more;
  return call;
}

/// What is shown, and who brings it.
class Watch {
 public:
  Watch(const Session& session, std::string lens)
      : socket_(session.globals().socket.value_or(std::string(proto::kDefaultSocket))),
        lens_(std::move(lens)),
        wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}
  ~Watch() {
    actions_.clear();
    look_.reset();
    states_.reset();
    close(wake_);
  }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  /// What there is now; from Begin() on it follows what happens.
  std::expected<void, Failure> Ask(DaemonClient& link);
  void Begin();
  int wake() const { return wake_; }
  void Drain() const {
    eventfd_t ignored;
    (void)eventfd_read(wake_, &ignored);
  }
  std::vector<StyledLine> Lines(TerminalScreen::Size size) {
    const std::lock_guard lock(mutex_);
    return WatchLines(state_, size);
  }
  /// Why the states have ceased to come.
  std::optional<Failure> ended() {
    const std::lock_guard lock(mutex_);
    return ended_;
  }
  /// False: it asks to end.
  bool Press(const std::string& key);

 private:
  void TakeStates(const Result<varlink::Reply>& reply);
  void LookAtSelected();
  void Select(std::ptrdiff_t by);
  void Act(const std::string& what, std::string_view method, Json parameters);
  std::string SelectedName();
  void Say(std::string text);
  void Wake() const { eventfd_write(wake_, 1); }

  const std::string socket_;
  const std::string lens_;
  const int wake_;
  std::mutex mutex_;
  WatchedState state_;            // guarded by mutex_
  std::optional<Failure> ended_;  // guarded by mutex_
  std::unique_ptr<BackgroundCall> states_;
  std::unique_ptr<BackgroundCall> look_;
  std::vector<std::unique_ptr<BackgroundCall>> actions_;
};

std::expected<void, Failure> Watch::Ask(DaemonClient& link) {
  const auto list = link.Ask(MethodOfLens("List"), Json::object());
  if (!list) return PassOn(list);
  for (const Json& info : (*list)["lenses"]) state_.infos[TextOf(info, "name")] = info;
  const auto status = link.Ask(MethodOfLens("Status"), {{"lens", lens_.empty() ? Json() : Json(lens_)}});
  if (!status) return PassOn(status);
  state_.lenses = (*status)["lenses"].get<std::vector<Json>>();
  return {};
}

void Watch::Begin() {
  states_ = std::make_unique<BackgroundCall>(socket_,
                                             CallOf("Status", {{"lens", lens_.empty() ? Json() : Json(lens_)}}, true),
                                             [this](const Result<varlink::Reply>& reply) { TakeStates(reply); });
  LookAtSelected();
}

/// The first reply has every lens, each later one that which has changed.
void Watch::TakeStates(const Result<varlink::Reply>& reply) {
  {
    const std::lock_guard lock(mutex_);
    if (!reply) {
      ended_ = Failure(reply.error());
    } else if (!reply->error.empty()) {
      ended_ = FailureOf(*reply);
    } else {
      for (const Json& lens : reply->parameters["lenses"]) {
        const auto known =
            std::ranges::find_if(state_.lenses, [&](const Json& each) { return each["name"] == lens["name"]; });
        known == state_.lenses.end() ? state_.lenses.push_back(lens) : void(*known = lens);
      }
    }
  }
  Wake();
}

std::string Watch::SelectedName() {
  const std::lock_guard lock(mutex_);
  return state_.selected < state_.lenses.size() ? TextOf(state_.lenses[state_.selected], "name") : "";
}

/// The camera of the chosen lens, a few frames a second and as small as they go: only what is said beside them counts.
void Watch::LookAtSelected() {
  look_.reset();
  const std::string name = SelectedName();
  {
    const std::lock_guard lock(mutex_);
    state_.sharpness.reset();
    state_.best_sharpness = 0.0;
    const auto info = state_.infos.find(name);
    if (info == state_.infos.end() || !info->second.value("camera", Json()).is_object()) return;
  }
  Json view{{"lens", name}, {"maxRateHz", 5}, {"encoding", "gray8"}, {"scaleTo", {{"widthPx", 8}, {"heightPx", 8}}}};
  look_ = std::make_unique<BackgroundCall>(
      socket_, CallOf("View", std::move(view), true), [this](const Result<varlink::Reply>& reply) {
        if (!reply || !reply->error.empty() || !reply->parameters.contains("picture")) return;
        const Json sharpness = reply->parameters["picture"].value("sharpness", Json());
        if (!sharpness.is_number()) return;
        {
          const std::lock_guard lock(mutex_);
          state_.sharpness = sharpness.get<double>();
          state_.best_sharpness = std::max(state_.best_sharpness, *state_.sharpness);
        }
        Wake();
      });
}

void Watch::Select(std::ptrdiff_t by) {
  {
    const std::lock_guard lock(mutex_);
    const auto next = static_cast<std::ptrdiff_t>(state_.selected) + by;
    if (next < 0 || std::cmp_greater_equal(next, state_.lenses.size())) return;
    state_.selected = static_cast<std::size_t>(next);
  }
  LookAtSelected();
  Wake();
}

void Watch::Say(std::string text) {
  {
    const std::lock_guard lock(mutex_);
    state_.said = std::move(text);
  }
  Wake();
}

/// A command goes its own way; the newest one wins in the daemon.
void Watch::Act(const std::string& what, std::string_view method, Json parameters) {
  constexpr std::size_t kMostAtATime = 8;
  std::erase_if(actions_, [](const auto& action) { return action->ended(); });
  if (actions_.size() >= kMostAtATime) return Say("too many commands are under way: wait, or stop");
  Say(what + " ...");
  actions_.push_back(std::make_unique<BackgroundCall>(
      socket_, CallOf(method, std::move(parameters), false), [this, what](const Result<varlink::Reply>& reply) {
        if (!reply) return reply.error().code == Code::Cancelled ? void() : Say(what + ": " + reply.error().message);
        // A step that a newer one displaced is none that failed.
        if (reply->error.ends_with(".Superseded")) return;
        Say(what + ": " + (reply->error.empty() ? "done" : FailureOf(*reply).message));
      }));
}

bool Watch::Press(const std::string& key) {
  struct Step {
    std::string_view key;
    int nearer;
  };
  static constexpr std::array kSteps = {Step{"left", 10}, Step{"right", -10}, Step{"[", 1},
                                        Step{"]", -1},    Step{"{", 100},     Step{"}", -100}};
  if (key == "q" || key == "\x1b") return false;
  if (key == "up") Select(-1);
  if (key == "down") Select(1);
  const std::string lens = SelectedName();
  if (lens.empty()) return true;
  if (const auto* step = std::ranges::find(kSteps, key, &Step::key); step != kSteps.end()) {
    const std::string way = step->nearer > 0 ? "nearer by " : "farther by ";
    Act(lens + ": focus " + way + std::to_string(std::abs(step->nearer)), "Move",
        {{"lens", lens}, {"axis", "focus"}, {"target", {{"nearer", step->nearer}}}});
  }
  if (key == " ") Act(lens + ": stop", "Stop", {{"lens", lens}});
  if (key == "f") Act(lens + ": autofocus", "Autofocus", {{"lens", lens}});
  return true;
}

/// What is typed by now.
std::string Typed() {
  std::array<char, 256> buffer{};
  const ssize_t count = read(STDIN_FILENO, buffer.data(), buffer.size());
  return count > 0 ? std::string(buffer.data(), static_cast<std::size_t>(count)) : "";
}

/// Draws when there is something new, at most so often; ends with the signal or key that ends it.
class Loop {
 public:
  Loop(Watch& watch, TerminalScreen& screen, std::optional<Instant> deadline)
      : watch_(watch), screen_(screen), deadline_(deadline) {}

  Outcome Run() {
    for (;;) {
      const Instant now = MonotonicClock().Now();
      if (deadline_ && now >= *deadline_) return Exit::Done;
      if (dirty_ && now - drawn_ >= kScreenRedrawEvery) {
        screen_.Draw(watch_.Lines(screen_.size()));
        drawn_ = now;
        dirty_ = false;
      }
      if (const auto end = Wait(now)) return *end;
    }
  }

 private:
  std::optional<Outcome> Wait(Instant now) {
    std::array<pollfd, 3> waiting = {pollfd{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0},
                                     pollfd{.fd = screen_.signals(), .events = POLLIN, .revents = 0},
                                     pollfd{.fd = watch_.wake(), .events = POLLIN, .revents = 0}};
    Instant until = dirty_ ? drawn_ + kScreenRedrawEvery : now + kLeaseTick;
    if (deadline_) until = std::min(until, *deadline_);
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(std::max(until - now, Duration::zero()));
    const int count = poll(waiting.data(), waiting.size(), static_cast<int>(left.count()));
    dirty_ |= count == 0 || waiting[2].revents != 0;
    watch_.Drain();
    if (waiting[1].revents != 0) {
      const int number = screen_.TakeSignal();
      if (number == SIGINT) return std::unexpected(Failure(Exit::Interrupted, "interrupted"));
      if (number != 0 && number != SIGWINCH && number != SIGTSTP) return Exit::Done;
      dirty_ = true;
    }
    if ((waiting[0].revents & (POLLHUP | POLLERR)) != 0) return Exit::Done;  // the terminal is gone
    if ((waiting[0].revents & POLLIN) != 0) {
      for (const std::string& key : KeysIn(Typed())) {
        if (!watch_.Press(key)) return Exit::Done;
      }
    }
    if (auto ended = watch_.ended()) return std::unexpected(*std::move(ended));
    return std::nullopt;
  }

  Watch& watch_;
  TerminalScreen& screen_;
  std::optional<Instant> deadline_;
  Instant drawn_{};
  bool dirty_ = true;
};

}  // namespace

Outcome WatchScreen(Session& session, const std::string& lens) {
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  std::optional<Instant> deadline;
  if (session.globals().timeout) deadline = MonotonicClock().Now() + *session.globals().timeout;
  Watch watch(session, lens);
  if (auto asked = watch.Ask(*link); !asked) return PassOn(asked);
  TerminalScreen screen;  // its signals are held back from the threads that begin now
  watch.Begin();
  return Loop(watch, screen, deadline).Run();
}

}  // namespace lensd::cli
