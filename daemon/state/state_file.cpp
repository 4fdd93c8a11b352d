// What is learned of a lens is in force at once, whatever its disk does.
#include "daemon/state/state_file.h"

#include <ctime>
#include <utility>

#include "daemon/events/log.h"
#include "daemon/lens/served_lens.h"
#include "daemon/state/kept_files.h"

namespace lensd::daemon {

void KeepStateFile(const ServedLens& lens, std::string file, std::string text, std::string what,
                   std::function<void(const Result<void>&)> then) {
  const KeptFile kept_file{.path = std::move(file), .lens = lens.name(), .what = what};
  auto ended = [name = lens.name(), what = std::move(what), then = std::move(then)](const Result<void>& kept,
                                                                                    const FileMark&) {
    if (!kept) Log(Severity::Warning, Event::StateNotKept, what + ": " + kept.error().message, name);
    then(kept ? kept : Fail(Code::NotKept, "in use, but not saved: " + kept.error().message));
  };
  lens.surroundings().files.Keep(kept_file, std::move(text), std::move(ended));
}

std::string StateFileMoment() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc)};
}

}  // namespace lensd::daemon
