// No disk is waited for in the event loop: a file that hangs keeps nothing but the others that wait behind it.
#include "state_file.h"

#include <ctime>
#include <utility>

#include "calibration_store.h"
#include "log.h"
#include "served_lens.h"

namespace lensd::daemon {

void KeepStateFile(const ServedLens& lens, std::string file, std::string text, std::string what,
                   std::function<void(const Result<void>&)> then) {
  const LensSurroundings& around = lens.surroundings();
  const auto ended = [name = lens.name(), what = std::move(what), then = std::move(then)](const Result<void>& kept) {
    if (!kept) Log(Severity::Warning, Event::StateNotKept, what + ": " + kept.error().message, name);
    then(kept ? kept : Fail(Code::NotKept, "in force, but not kept: " + kept.error().message));
  };
  auto keep = [&loop = around.loop, end = ended, file = std::move(file), text = std::move(text)]() mutable {
    auto kept = Keep(file, text);
    // Moved on: it may hold a call, which is let go of where calls live.
    loop.Post([tell = std::move(end), kept = std::move(kept)] { tell(kept); });
  };
  const bool taken = around.files.Submit(std::move(keep));
  if (!taken) ended(Fail(Code::Busy, "too much waits to be written"));
}

std::string StateFileMoment() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc)};
}

}  // namespace lensd::daemon
