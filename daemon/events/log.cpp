// Lines go to a thread of their own, because their reader may be slow or gone: no thread that logs ever waits. Each
// kind of line has a rate; what is left out is counted and told of.
#include "daemon/events/log.h"

#include <sys/stat.h>
#include <unistd.h>

#define SD_JOURNAL_SUPPRESS_LOCATION
#include <spdlog/details/null_mutex.h>
#include <spdlog/logger.h>
#include <spdlog/sinks/base_sink.h>
#include <syslog.h>
#include <systemd/sd-journal.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <climits>
#include <condition_variable>
#include <cstdlib>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

namespace lensd::daemon {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr std::size_t kMostLines = 1000;  ///< that wait to be written
constexpr int kMostInPeriod = 100;        ///< of one kind
constexpr auto kPeriod = std::chrono::seconds(10);
constexpr auto kFlushAtMost = std::chrono::milliseconds(200);
constexpr std::size_t kKinds = 26;

const char* MessageId(Event event) {
  switch (event) {
    case Event::Started:
      return "5d1e0c9d6b714cf2a6a5d0a3b0e1f7c4";
    case Event::Reloaded:
      return "1f7ad2c36be9408593a50c7de4b86f12";
    case Event::Stopping:
      return "e3b7f6a2195c4f0db1c28d5c7a94e610";
    case Event::LensReady:
      return "0b9c4a7731e84b8c92f3d6e5a8b17f2d";
    case Event::LensLost:
      return "9a4f21c8e07d4d35b6ce1470f2a9836b";
    case Event::CalibrationMissing:
      return "2f61c7d0b8e94a13957d0c4ea1f3b862";
    case Event::StateUnreadable:
      return "81d3e05f6a2b4c97b4e8f7152c90da3e";
    case Event::NotHomed:
      return "d62b9f4718c345e0a1738b5fe0c46d29";
    case Event::LensFailed:
      return "6c0e94d1f7a24b58b3d92f06ea71c845";
    case Event::MoveFailed:
      return "a20d6f5be3194c87905be4d81c7f3a26";
    case Event::ThermometerFault:
      return "c94f1e7a5b0d4d26a7e3180f6d2b95ce";
    case Event::AxisFault:
      return "3be97c14d05f4f6d8a21c6f0b98e57d3";
    case Event::AutofocusRefused:
      return "f4816ab7203e4d5c9ed07b35a61c82f9";
    case Event::ClientDropped:
      return "c70d58e1a2b34e6f8f19b3047d6a5c92";
    case Event::CommandFailed:
      return "47e8b1d39f604a1c8d52e6c0f7a3b915";
    case Event::MotorsNotStopped:
      return "b8135fe04c6d49a7a0e2d17c53f6980b";
    case Event::StateNotKept:
      return "7d92a0e4c16f4b38a5ce80d3f1b76249";
    case Event::NotParked:
      return "e05b8d1c97a24f36b0c4d2e81f6a3975";
    case Event::FailureNotTold:
      return "19f6c3b2d8054e7fa4be96d1705c8a2e";
    case Event::Refocused:
      return "52c1e7f09b3d4a68b7f4d0a39e6c8125";
    case Event::SlopeForgotten:
      return "a7e2409d5c1b4f83960d7be4f1c8a352";
    case Event::PartLeftOut:
      return "38c5f1a06e9d4b72a1f3e70d9b24c6d8";
    case Event::DriverPrinted:
      return "d3a7f05c18be4e92b6c41d7f90a85e23";
    case Event::MovedExternally:
      return "6fb09d3e8c1a47d5b2e4907fa35c81d6";
    case Event::BroughtBack:
      return "d1847ac05e2f4b93a6c07e19f8d3b524";
  }
  return "";
}

struct Line {
  Severity severity;
  Event event;
  std::string message, lens, axis{};
};

/// The line being written by the writer's thread: spdlog carries text only.
const Line* written_line = nullptr;

using Sink = spdlog::sinks::base_sink<spdlog::details::null_mutex>;  // one thread writes

/// Sends each line with its fields. A journal that cannot be reached costs the line, never the daemon.
class JournalSink final : public Sink {
  void sink_it_(const spdlog::details::log_msg&) override {
    constexpr int kPriorities[] = {LOG_INFO, LOG_WARNING, LOG_ERR};
    const Line& line = *written_line;
    sd_journal_send("MESSAGE=%s", line.message.c_str(), "PRIORITY=%i", kPriorities[static_cast<int>(line.severity)],
                    "MESSAGE_ID=%s", MessageId(line.event), "SYSLOG_IDENTIFIER=lensd",
                    line.lens.empty() ? nullptr : "LENS=%s", line.lens.c_str(), line.axis.empty() ? nullptr : "AXIS=%s",
                    line.axis.c_str(), nullptr);
  }
  void flush_() override {}
};

/// In pieces that a pipe takes whole, past stdio, whose lock a hanging pipe would hold for ever.
class StderrSink final : public Sink {
  void sink_it_(const spdlog::details::log_msg& line) override {
    spdlog::memory_buf_t text;
    formatter_->format(line, text);
    for (std::string_view rest(text.data(), text.size()); !rest.empty();) {
      const ssize_t written = write(STDERR_FILENO, rest.data(), std::min<std::size_t>(rest.size(), PIPE_BUF));
      if (written < 0 && errno != EINTR) return;
      rest.remove_prefix(written < 0 ? 0 : static_cast<std::size_t>(written));
    }
  }
  void flush_() override {}
};

/// systemd connects stderr to the journal and says which device and inode that is.
bool StderrIsJournal() {
  const char* stream = std::getenv("JOURNAL_STREAM");
  struct stat here{};
  if (stream == nullptr || fstat(STDERR_FILENO, &here) != 0) return false;
  return stream == std::to_string(here.st_dev) + ":" + std::to_string(here.st_ino);
}

spdlog::logger MakeLogger(bool journal) {
  std::shared_ptr<spdlog::sinks::sink> sink;
  if (journal) {
    sink = std::make_shared<JournalSink>();
  } else {
    sink = std::make_shared<StderrSink>();
  }
  spdlog::logger logger("lensd", std::move(sink));
  logger.set_pattern("%H:%M:%S.%e %l %v");
  logger.set_error_handler([](const std::string&) {});
  return logger;
}

class LogWriter {
 public:
  explicit LogWriter(bool journal) : logger_(MakeLogger(journal)), thread_([this] { Run(); }) {}

  void Add(Line line) {
    {
      const std::lock_guard lock(mutex_);
      Kind& kind = kinds_[static_cast<std::size_t>(line.event) % kKinds];
      const auto now = SteadyClock::now();
      if (now - kind.since > kPeriod) {
        if (const int left_out = std::exchange(kind, Kind{now, 0, 0}).left_out; left_out > 0) {
          lines_.push_back({line.severity, line.event, std::to_string(left_out) + " such lines were left out", ""});
        }
      }
      if (++kind.lines > kMostInPeriod || lines_.size() >= kMostLines) {
        ++kind.left_out;
        return;
      }
      lines_.push_back(std::move(line));
    }
    changed_.notify_all();
  }

  /// Until all is written, or no reader is left.
  void Flush() {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kFlushAtMost, [this] { return lines_.empty() && !writing_; });
  }

 private:
  struct Kind {
    SteadyClock::time_point since{};
    int lines = 0;
    int left_out = 0;
  };

  void Run() {
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [this] { return !lines_.empty(); });
      const Line line = std::move(lines_.front());
      lines_.pop_front();
      writing_ = true;
      lock.unlock();
      written_line = &line;
      constexpr spdlog::level::level_enum kLevels[] = {spdlog::level::info, spdlog::level::warn, spdlog::level::err};
      logger_.log(kLevels[static_cast<int>(line.severity)], "{}{}{}", line.lens, line.lens.empty() ? "" : ": ",
                  line.message);
      lock.lock();
      writing_ = false;
      changed_.notify_all();
    }
  }

  spdlog::logger logger_;  // used by the thread alone
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Line> lines_;  // guarded by mutex_, as all below
  std::array<Kind, kKinds> kinds_;
  bool writing_ = false;
  std::thread thread_;  // never joined: it may hang in a pipe without a reader
};

/// Lives until the process ends.
LogWriter* writer = nullptr;
std::function<void(Failure)>* failure_listener = nullptr;

}  // namespace

void OpenLog() {
  writer = new LogWriter(StderrIsJournal());
  std::atexit(FlushLog);
}

void OnFailure(std::function<void(Failure)> told) {
  failure_listener = new std::function<void(Failure)>(std::move(told));
}

std::string_view EventName(Event event) {
  static constexpr std::array<std::string_view, 25> kNames = {
      "started",      "reloaded",       "stopping",         "lensReady",        "lensLost",      "calibrationMissing",
      "stateDamaged", "notHomed",       "lensFailed",       "moveFailed",       "axisFault",     "autofocusRefused",
      "dropped",      "callFailed",     "motorsNotStopped", "notKept",          "notParked",     "failureNotTold",
      "refocused",    "slopeForgotten", "partLeftOut",      "thermometerFault", "driverPrinted", "external",
      "broughtBack"};
  return kNames[static_cast<std::size_t>(event)];
}

void FlushLog() {
  if (writer != nullptr) writer->Flush();
}

void Log(Severity severity, Event event, std::string_view message, LogSubject about) {
  if (failure_listener != nullptr && severity != Severity::Info && !about.lens.empty()) {
    (*failure_listener)({severity, event, std::string(message), std::string(about.lens), std::string(about.axis)});
  }
  if (writer == nullptr) return;
  writer->Add({severity, event, std::string(message), std::string(about.lens), std::string(about.axis)});
}

}  // namespace lensd::daemon
