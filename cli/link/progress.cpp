// The line stays away from short commands: it begins a second after they did.
#include "cli/link/progress.h"

#include <signal.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <utility>

#include "cli/link/daemon_client.h"
#include "cli/text/texts.h"
#include "proto/interfaces.h"
#include "varlink/client.h"

namespace lensd::cli {
namespace {

using varlink::Json;

constexpr Duration kQuietFor = std::chrono::seconds(1);
constexpr Duration kRedrawEvery = std::chrono::milliseconds(100);

/// Columns of the terminal that may be written without beginning another line.
int ColumnsOfTerminal() {
  constexpr int kUsual = 80;
  winsize size{};
  const bool known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return (known ? size.ws_col : kUsual) - 1;
}

/// A thread for which no signal is meant: Control-C is the command's own.
std::thread WithoutSignals(std::function<void()> run) {
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  std::thread thread(std::move(run));
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return thread;
}

}  // namespace

ProgressLine::ProgressLine(const Session& session) : on_(isatty(STDERR_FILENO) == 1 && !session.json()) {}

void ProgressLine::Show(const std::string& text) {
  if (!on_) return;
  const int columns = ColumnsOfTerminal();
  std::fprintf(stderr, "\r%-*.*s", columns, columns, text.c_str());
  std::fflush(stderr);
  shown_ = true;
}

void ProgressLine::Clear() {
  if (shown_) std::fprintf(stderr, "\r%*s\r", ColumnsOfTerminal(), "");
  shown_ = false;
}

ProgressLine::~ProgressLine() {
  Clear();
}

ActivityLine::ActivityLine(const Session& session, Json lens)
    : socket_(session.globals().socket.value_or(std::string(proto::kDefaultSocket))),
      lens_(std::move(lens)),
      line_(session) {
  if (!line_.on()) return;
  stop_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  thread_ = WithoutSignals([this] { Run(); });
}

ActivityLine::~ActivityLine() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  changed_.notify_all();
  eventfd_write(stop_, 1);
  thread_.join();
  close(stop_);
}

/// The time in which nothing is said. False: the command has ended meanwhile.
bool ActivityLine::Quiet() {
  std::unique_lock lock(mutex_);
  return !changed_.wait_for(lock, kQuietFor, [this] { return ended_; });
}

/// Without a daemon that answers there is nothing to tell here: the command itself says so.
void ActivityLine::Run() {
  const Instant began = MonotonicClock().Now();
  if (!Quiet()) return;
  auto client = varlink::Client::Connect(socket_);
  if (!client) return;
  client->SetInterrupt(stop_);
  varlink::Call call;
  call.method = MethodOfLens("Status");
  call.parameters = {{"lens", lens_}};
  call.more = true;
  if (!client->Send(call)) return;
  Instant drawn{};
  for (;;) {
    const auto reply = client->Receive();
    if (!reply || !reply->error.empty()) return;
    const Instant now = MonotonicClock().Now();
    const Json& lenses = reply->parameters["lenses"];
    if (lenses.empty() || now - drawn < kRedrawEvery) continue;
    drawn = now;
    const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(now - began).count();
    line_.Show(std::to_string(seconds) + " s, " + ActivityText(lenses[0]));
  }
}

}  // namespace lensd::cli
