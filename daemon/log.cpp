#include "log.h"

#include <sys/stat.h>
#include <unistd.h>

#define SD_JOURNAL_SUPPRESS_LOCATION
#include <spdlog/sinks/base_sink.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <syslog.h>
#include <systemd/sd-journal.h>

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <string>

namespace lensd::daemon {
namespace {

/// Fields of the line being logged on this thread: spdlog carries text only.
struct Fields {
  std::string_view lens;
  const char* message_id = "";
};
thread_local Fields fields;

const char* MessageId(Event event) {
  switch (event) {
    case Event::Started:
      return "5d1e0c9d6b714cf2a6a5d0a3b0e1f7c4";
    case Event::Stopping:
      return "e3b7f6a2195c4f0db1c28d5c7a94e610";
    case Event::LensReady:
      return "0b9c4a7731e84b8c92f3d6e5a8b17f2d";
    case Event::LensLost:
      return "9a4f21c8e07d4d35b6ce1470f2a9836b";
    case Event::ClientDropped:
      return "c70d58e1a2b34e6f8f19b3047d6a5c92";
    case Event::CommandFailed:
      return "47e8b1d39f604a1c8d52e6c0f7a3b915";
  }
  return "";
}

int Priority(spdlog::level::level_enum level) {
  if (level >= spdlog::level::err) return LOG_ERR;
  return level == spdlog::level::warn ? LOG_WARNING : LOG_INFO;
}

/// Sends each line with its fields. A journal that cannot be reached costs the line, never the daemon.
class JournalSink final : public spdlog::sinks::base_sink<std::mutex> {
  void sink_it_(const spdlog::details::log_msg& line) override {
    const std::string message(line.payload.data(), line.payload.size());
    const std::string lens(fields.lens);
    sd_journal_send("MESSAGE=%s", message.c_str(), "PRIORITY=%i", Priority(line.level), "MESSAGE_ID=%s",
                    fields.message_id, "SYSLOG_IDENTIFIER=lensd", lens.empty() ? nullptr : "LENS=%s", lens.c_str(),
                    nullptr);
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

}  // namespace

void OpenLog() {
  std::shared_ptr<spdlog::sinks::sink> sink;
  if (StderrIsJournal()) {
    sink = std::make_shared<JournalSink>();
  } else {
    sink = std::make_shared<spdlog::sinks::stderr_color_sink_mt>();
  }
  auto logger = std::make_shared<spdlog::logger>("lensd", std::move(sink));
  logger->set_pattern("%H:%M:%S.%e %^%l%$ %v");
  logger->set_error_handler([](const std::string&) {});
  spdlog::set_default_logger(std::move(logger));
}

void Log(Severity severity, Event event, std::string_view message, std::string_view lens) {
  constexpr spdlog::level::level_enum kLevels[] = {spdlog::level::info, spdlog::level::warn, spdlog::level::err};
  fields = {lens, MessageId(event)};
  const auto level = kLevels[static_cast<int>(severity)];
  if (lens.empty() || StderrIsJournal()) {
    spdlog::log(level, "{}", message);
  } else {
    spdlog::log(level, "{}: {}", lens, message);
  }
  fields = {};
}

}  // namespace lensd::daemon
