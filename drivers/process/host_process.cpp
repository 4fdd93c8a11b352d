// Between fork() and exec() only calls that are safe after a fork of a process with threads: all that they need is made
// before.
#include "host_process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <set>
#include <utility>
#include <vector>

#include "drivers/wire/wire.h"

namespace lensd::drivers::process {
namespace {

constexpr int kPassedSocket = 3;  // where systemd's protocol begins
constexpr int kCannotRun = 127;
/// It ends by itself within 2 s; on a busy machine it gets a second more before it is killed.
constexpr auto kEndAtMost = std::chrono::seconds(3);
constexpr auto kLinesAtMost = std::chrono::seconds(2);
constexpr std::string_view kPidKey = "LISTEN_PID=";
constexpr std::size_t kPidDigits = 10;

std::string Why(int error_number) {
  return std::strerror(error_number);
}

/// Of the service where lensd is one, else of the user.
std::string RuntimeFolder() {
  for (const char* name : {"RUNTIME_DIRECTORY", "XDG_RUNTIME_DIR", "TMPDIR"}) {
    const char* folder = std::getenv(name);
    // Of several folders the first; a long one has no room for a socket.
    const std::string_view first =
        folder == nullptr ? "" : std::string_view(folder).substr(0, std::strcspn(folder, ":"));
    if (!first.empty() && first.size() < 60 && access(std::string(first).c_str(), W_OK) == 0) return std::string(first);
  }
  return "/tmp";
}

sockaddr_un AddressOf(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof(address.sun_path) - 1);
  return address;
}

/// The strings of execve(), made before fork(). The process number is put in by the child.
class Words {
 public:
  explicit Words(const Program& program) : arguments_(program.command) {
    constexpr std::array<std::string_view, 3> kOurs = {"NOTIFY_SOCKET=", "WATCHDOG_", "LISTEN_"};
    for (char** each = environ; *each != nullptr; ++each) {
      const std::string_view text(*each);
      if (std::ranges::none_of(kOurs, [&](std::string_view ours) { return text.starts_with(ours); })) {
        environment_.emplace_back(text);
      }
    }
    environment_.insert(environment_.end(), {"LISTEN_FDS=1", "LISTEN_FDNAMES=varlink"});
    environment_.push_back(std::string(kPidKey) + std::string(kPidDigits, '0'));
    Point(arguments_, argument_pointers_);
    Point(environment_, environment_pointers_);
  }

  void SetProcess(pid_t process) {
    char* digits = environment_pointers_[environment_.size() - 1] + kPidKey.size();
    for (std::size_t i = kPidDigits; i-- > 0; process /= 10) digits[i] = static_cast<char>('0' + process % 10);
  }
  char* const* arguments() const { return argument_pointers_.data(); }
  char* const* environment() const { return environment_pointers_.data(); }

 private:
  static void Point(std::vector<std::string>& words, std::vector<char*>& pointers) {
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
  }

  std::vector<std::string> arguments_;
  std::vector<std::string> environment_;
  std::vector<char*> argument_pointers_;
  std::vector<char*> environment_pointers_;
};

/// What the kernel cannot refuse is printed by every process of a driver: one of these lines is enough.
std::function<void(std::string_view)> EachLackOnce(const Program& program) {
  if (!program.log) return {};
  return [log = program.log, driver = program.driver](std::string_view line) {
    static std::mutex mutex;
    static std::set<std::string> said;
    {
      const std::lock_guard lock(mutex);
      if (line.starts_with(wire::kNotConfined) && !said.insert(driver + ": " + std::string(line)).second) return;
    }
    log(line);
  };
}

/// In the child, until it is another program.
[[noreturn]] void Become(Words& words, int nothing, int output, int listening) {
  setpgid(0, 0);  // a Ctrl-C in a terminal is for lensd, which then closes the devices in order
  dup2(nothing, STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  dup2(output, STDERR_FILENO);
  if (listening == kPassedSocket) {
    fcntl(listening, F_SETFD, 0);
  } else {
    dup2(listening, kPassedSocket);
  }
  close_range(kPassedSocket + 1, ~0U, 0);
  struct sigaction fallback{};
  fallback.sa_handler = SIG_DFL;
  for (int signal = 1; signal < NSIG; ++signal) sigaction(signal, &fallback, nullptr);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  words.SetProcess(getpid());
  execve(words.arguments()[0], words.arguments(), words.environment());
  _exit(kCannotRun);
}

}  // namespace

// ---- what it prints -------------------------------------------------------------------------------------------------

void PrintedLines::Take(std::string_view bytes, Instant now) {
  for (const char c : bytes) {
    if (c == '\n') {
      Line(now);
    } else if (line_.size() < kLongestLine) {
      const auto code = static_cast<unsigned char>(c);
      line_ += code < 0x20 || code == 0x7f ? ' ' : c;
    }
  }
}

void PrintedLines::Line(Instant now) {
  const std::string line = std::exchange(line_, {});
  if (line.find_first_not_of(' ') == std::string::npos) return;
  {
    const std::lock_guard lock(mutex_);
    last_.push_back(line);
    if (last_.size() > kKept) last_.pop_front();
  }
  Pass(line, now);
}

void PrintedLines::Pass(const std::string& line, Instant now) {
  if (!log_) return;
  if (now >= second_ + std::chrono::seconds(1)) {
    second_ = now;
    passed_ = 0;
    if (left_out_ > 0) log_("(" + std::to_string(std::exchange(left_out_, 0)) + " more lines were printed)");
  }
  if (passed_++ < kMostInASecond) {
    log_(line);
  } else {
    ++left_out_;
  }
}

void PrintedLines::End(Instant now) {
  if (!line_.empty()) Line(now);
  if (left_out_ > 0 && log_) log_("(" + std::to_string(std::exchange(left_out_, 0)) + " more lines were printed)");
  const std::lock_guard lock(mutex_);
  ended_ = true;
  ended_changed_.notify_all();
}

std::string PrintedLines::Last() {
  std::unique_lock lock(mutex_);
  ended_changed_.wait_for(lock, kLinesAtMost, [this] { return ended_; });
  std::string text;
  for (const std::string& line : last_) text += (text.empty() ? "; it printed last: " : " | ") + line;
  return text;
}

HostProcess::HostProcess(const Program& program) : printed_(EachLackOnce(program)) {}

// ---- its life -------------------------------------------------------------------------------------------------------

Result<std::shared_ptr<HostProcess>> HostProcess::Start(const Program& program) {
  if (program.command.empty()) return Fail(Code::InvalidArgument, "a driver needs a command");
  const std::string& path = program.command.front();
  if (access(path.c_str(), X_OK) != 0) {
    return Fail(Code::Disconnected, "the driver " + path + " cannot be run: " + Why(errno));
  }
  std::shared_ptr<HostProcess> started(new HostProcess(program));
  const auto listening = started->Listen();
  if (!listening) return PassOn(listening);
  if (auto spawned = started->Spawn(program, *listening); !spawned) return PassOn(spawned);
  started->reader_ = std::thread([host = started.get()] { host->ReadPrinted(); });
  return started;
}

Result<daemon::Descriptor> HostProcess::Listen() {
  folder_ = RuntimeFolder() + "/lensd-driver-XXXXXX";
  if (mkdtemp(folder_.data()) == nullptr) {
    const int why = errno;
    return Fail(Code::Disconnected,
                "no folder for the socket of a driver, " + std::exchange(folder_, {}) + ": " + Why(why));
  }
  path_ = folder_ + "/io.lensd.Driver";
  daemon::Descriptor listening(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const sockaddr_un address = AddressOf(path_);
  if (!listening || bind(listening.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      listen(listening.get(), 64) != 0) {
    return Fail(Code::Disconnected, "no socket for a driver at " + path_ + ": " + Why(errno));
  }
  return listening;
}

Result<void> HostProcess::Spawn(const Program& program, const daemon::Descriptor& listening) {
  Words words(program);
  int ends[2];
  enough_ = daemon::Descriptor(eventfd(0, EFD_CLOEXEC));
  if (!enough_ || pipe2(ends, O_CLOEXEC) != 0) return Fail(Code::Disconnected, "no pipe for a driver: " + Why(errno));
  output_ = daemon::Descriptor(ends[0]);
  const daemon::Descriptor printing(ends[1]);
  const daemon::Descriptor nothing(open("/dev/null", O_RDONLY | O_CLOEXEC));
  process_ = fork();
  if (process_ == 0) Become(words, nothing.get(), printing.get(), listening.get());
  if (process_ < 0) return Fail(Code::Disconnected, "no process for a driver: " + Why(errno));
  handle_ = daemon::Descriptor(static_cast<int>(syscall(SYS_pidfd_open, process_, 0)));
  return {};
}

void HostProcess::ReadPrinted() {
  std::array<pollfd, 2> waits{{{output_.get(), POLLIN, 0}, {enough_.get(), POLLIN, 0}}};
  std::array<char, 4096> bytes;
  const MonotonicClock clock;
  for (;;) {
    if (poll(waits.data(), waits.size(), -1) < 0) continue;
    if (waits[0].revents == 0) break;
    const ssize_t count = read(output_.get(), bytes.data(), bytes.size());
    if (count <= 0) break;
    printed_.Take({bytes.data(), static_cast<std::size_t>(count)}, clock.Now());
  }
  printed_.End(clock.Now());
}

HostProcess::~HostProcess() {
  if (process_ > 0) {
    if (!WaitForEnd(kEndAtMost)) Kill();
    Bury();
  }
  if (reader_.joinable()) {
    (void)printed_.Last();            // what it printed at its end
    eventfd_write(enough_.get(), 1);  // its own children may hold the pipe open
    reader_.join();
  }
  if (!path_.empty()) unlink(path_.c_str());
  if (!folder_.empty()) rmdir(folder_.c_str());
}

Result<daemon::Descriptor> HostProcess::Connect() const {
  daemon::Descriptor client(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const sockaddr_un address = AddressOf(path_);
  if (!client || connect(client.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    const bool refused = errno == ECONNREFUSED;
    return Fail(refused ? Code::Disconnected : Code::Busy, "no connection to the driver: " + Why(errno));
  }
  return client;
}

bool HostProcess::running() const {
  return !WaitForEnd({});
}

bool HostProcess::WaitForEnd(Duration at_most) const {
  const Instant deadline = MonotonicClock().Now() + at_most;
  pollfd ends{handle_.get(), POLLIN, 0};
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - MonotonicClock().Now()).count();
    const int ready = poll(&ends, 1, static_cast<int>(std::max<std::int64_t>(left, 0)));
    if (ready > 0) return true;
    if (ready == 0 || errno != EINTR) return false;
  }
}

void HostProcess::Kill() {
  const std::lock_guard lock(mutex_);
  if (!ended_) kill(process_, SIGKILL);  // not buried, so the number is still its own
}

void HostProcess::Bury() {
  const std::lock_guard lock(mutex_);
  siginfo_t end{};
  if (ended_ || waitid(P_PID, static_cast<id_t>(process_), &end, WEXITED) != 0) return;
  ended_ = (end.si_code == CLD_EXITED ? "exit status " : "signal ") + std::to_string(end.si_status);
}

Error HostProcess::HowItEnded(std::string_view method) {
  const std::string in = " in " + std::string(method);
  if (!WaitForEnd(kEndAtMost)) return EndBecause("the driver closed its connection" + in + ", and was ended");
  Bury();
  const std::string lines = printed_.Last();
  const std::lock_guard lock(mutex_);
  const std::string how = "the driver ended: " + ended_.value_or("unknown") + in;
  return {Code::Disconnected, (ended_because_.empty() ? how : ended_because_) + lines};
}

Error HostProcess::EndBecause(const std::string& why) {
  {
    const std::lock_guard lock(mutex_);
    if (ended_because_.empty()) ended_because_ = why;
  }
  Kill();
  WaitForEnd(kEndAtMost);
  const std::string lines = printed_.Last();
  const std::lock_guard lock(mutex_);
  return {Code::Disconnected, ended_because_ + lines};
}

}  // namespace lensd::drivers::process
