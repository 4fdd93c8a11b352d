// One task a file at a time: what is asked for meanwhile waits here, where the newest takes the place of the others.
#include "daemon/state/kept_files.h"

#include <chrono>
#include <utility>

#include "base/guarded.h"
#include "daemon/events/log.h"
#include "daemon/state/lens_state_files.h"

namespace lensd::daemon {
namespace {

constexpr Duration kTryAgainAfter = std::chrono::milliseconds(250);

}  // namespace

void KeptFiles::Keep(const KeptFile& file, std::string text, Then then) {
  if (file.path.empty()) return loop_.Post([then = std::move(then)] { then({}, {}); });
  Text& kept = texts_[file.path];
  kept.file = file;
  kept.text = std::move(text);
  kept.newer = true;
  kept.forgotten = false;
  if (kept.waiting.size() >= TaskThread::kMostTasks) {
    return then(Fail(Code::Busy, "too much waits to be written"), {});
  }
  kept.waiting.push_back(std::move(then));
  if (!kept.under_way) Begin(file.path, kept);
}

/// What hears of it stays here: it may hold a call, which is let go of where calls live.
void KeptFiles::Begin(const std::string& path, Text& text) {
  text.newer = false;
  text.under_way = true;
  text.answering = std::exchange(text.waiting, {});
  const bool taken = thread_.Submit([this, path, content = text.text] {
    Result<void> kept = Fail(Code::Internal, path + ": cannot be written");
    if (auto thrown = Guarded(path, [&] { kept = daemon::Keep(path, content); })) kept = PassOn(*thrown);
    loop_.Post([this, path, kept = std::move(kept), mark = MarkOf(path)] { Ended(path, kept, mark); });
  });
  if (!taken) Ended(path, Fail(Code::Busy, "too much waits to be written"), {});
}

void KeptFiles::Ended(const std::string& path, const Result<void>& kept, const FileMark& mark) {
  const auto found = texts_.find(path);
  if (found == texts_.end()) return;
  Text& text = found->second;
  const auto answering = std::exchange(text.answering, {});
  const bool failed_before = !text.why.empty();
  text.under_way = false;
  text.why = kept ? "" : kept.error().message;
  if (kept && failed_before && finishing_) {
    Log(Severity::Info, Event::StateNotKept, text.file.what + ": on disk after all", text.file.lens);
  }
  if (text.newer) {
    Begin(path, text);
  } else if (kept || text.forgotten || text.file.otherwise == KeptFile::Otherwise::Undone) {
    texts_.erase(found);
  }
  for (const Then& then : answering) then(kept, mark);
}

void KeptFiles::Forget(const std::string& path) {
  const auto found = texts_.find(path);
  if (found == texts_.end()) return;
  found->second.forgotten = true;
  if (!found->second.under_way) texts_.erase(found);
}

bool KeptFiles::Finish(Instant now) {
  finishing_ = true;
  if (now - tried_ < kTryAgainAfter) return texts_.empty();
  tried_ = now;
  std::vector<std::string> again;
  for (const auto& [path, text] : texts_) {
    if (!text.under_way) again.push_back(path);
  }
  for (const std::string& path : again) {
    if (const auto found = texts_.find(path); found != texts_.end()) Begin(path, found->second);
  }
  return texts_.empty();
}

std::vector<KeptFiles::Missing> KeptFiles::missing() const {
  std::vector<Missing> missing;
  for (const auto& [path, text] : texts_) missing.push_back({text.file, text.why});
  return missing;
}

}  // namespace lensd::daemon
