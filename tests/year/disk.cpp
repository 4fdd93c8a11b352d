// The functions of libc that lensd writes its state with. Beside the folder of this machine, which has what every
// process sees, it keeps what would be there after a power cut: what fsync() of the file and of the folder have let
// through.
#include "disk.h"

#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdlib.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string_view>
#include <vector>

#include "scheduler.h"

namespace lensd::year::disk {
namespace {

using machine::Scheduler;

struct Renamed {
  std::string name;
  std::string content;
};

struct State {
  std::string folder;
  std::map<std::string, std::string> lasting;  ///< by name
  std::vector<Renamed> pending;                ///< not flushed
  std::map<std::string, std::string> flushed;  ///< temporary files, by path
  std::map<int, std::string> open;             ///< path of a temporary file, or the folder
  Trouble trouble;
  std::uint64_t kill_in = 0;
  bool lies = false;
  Counts counts;
};

State& Now() {
  static State state;
  return state;
}

std::string Content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

bool Ours(std::string_view path) {
  const std::string& folder = Now().folder;
  return !folder.empty() && Scheduler::Get() != nullptr && path.starts_with(folder + "/");
}

bool IsFolder(std::string_view path) {
  return Scheduler::Get() != nullptr && path == Now().folder;
}

/// One call to the disk begins. Its errno; 0: it works.
int Call(std::initializer_list<int> errors) {
  State& here = Now();
  Scheduler& machine = *Scheduler::Get();
  ++here.counts.calls;
  if (here.kill_in > 0) {
    --here.kill_in;
    if (here.kill_in == 0) machine::StopHere();
  }
  if (here.trouble.slow > 0)
    machine::Sleep(1 + static_cast<std::int64_t>(machine.chance.Pause(static_cast<double>(here.trouble.slow))));
  if (machine.chance.Unit() >= here.trouble.fails) return 0;
  ++here.counts.failed;
  return *(errors.begin() + machine.chance.Below(errors.size()));
}

/// As fsync() of a file: what the file has now is kept, whatever its name becomes.
void Flush(const std::string& path) {
  if (!Now().lies) Now().flushed[path] = Content(path);
}

void FlushFolder() {
  for (Renamed& renamed : Now().pending) Now().lasting[renamed.name] = std::move(renamed.content);
  Now().pending.clear();
}

void NoteRename(const std::string& from, const std::string& to) {
  State& here = Now();
  const auto flushed = here.flushed.find(from);
  std::string content = Content(to);
  if (flushed == here.flushed.end()) content.resize(Scheduler::Get()->chance.Below(content.size() + 1));
  here.pending.push_back({std::filesystem::path(to).filename().string(), std::move(content)});
  here.flushed.erase(from);
  ++here.counts.replaced;
}

}  // namespace

void Mount(const std::string& folder) {
  State& here = Now();
  here.folder = folder;
  here.open.clear();
  here.flushed.clear();
}

void Set(const Trouble& trouble) {
  Now().trouble = trouble;
}
void KillAtCall(std::uint64_t n) {
  Now().kill_in = n;
}
void Lie() {
  Now().lies = true;
}
const Counts& counts() {
  return Now().counts;
}
void FlushAll() {
  FlushFolder();
}

void LosePower(Chance& chance) {
  State& here = Now();
  const std::size_t through = chance.Below(here.pending.size() + 1);
  here.pending.resize(through);
  FlushFolder();
  for (const auto& entry : std::filesystem::directory_iterator(here.folder)) {
    // Of a file that was being written something may be left, under its temporary name.
    const bool temporary = entry.path().filename().string().starts_with('.');
    if (!temporary || chance.OneIn(2)) std::filesystem::remove(entry.path());
  }
  for (const auto& [name, content] : here.lasting) std::ofstream(here.folder + "/" + name, std::ios::binary) << content;
}

}  // namespace lensd::year::disk

using namespace lensd::year;
using machine::Scheduler;

namespace {

int Failed(int error) {
  errno = error;
  return -1;
}

std::string PathOf(int descriptor) {
  const auto& open = disk::Now().open;
  const auto found = Scheduler::Get() == nullptr ? open.end() : open.find(descriptor);
  return found == open.end() ? "" : found->second;
}

}  // namespace

extern "C" {

int mkostemp(char* path, int flags) {
  static std::uint64_t count = 0;
  if (disk::Ours(path)) {
    if (const int error = disk::Call({ENOSPC, EROFS, EMFILE})) return Failed(error);
  }
  const std::string number = std::to_string(1'000'000 + ++count % 1'000'000);
  char* const letters = path + std::string_view(path).size() - 6;
  std::copy(number.end() - 6, number.end(), letters);
  const int descriptor =
      static_cast<int>(machine::Real().call(SYS_openat, AT_FDCWD, path, O_RDWR | O_CREAT | O_EXCL | flags, 0600));
  if (descriptor >= 0 && disk::Ours(path)) disk::Now().open[descriptor] = path;
  return descriptor;
}

int open(const char* path, int flags, ...) {
  va_list list;
  va_start(list, flags);
  const int mode = va_arg(list, int);
  va_end(list);
  const bool folder = disk::IsFolder(path);
  const bool file = disk::Ours(path) && (flags & O_ACCMODE) == O_RDONLY;
  if (file || folder) {
    if (const int error = disk::Call({EIO, EMFILE})) return Failed(error);
  }
  const int descriptor = static_cast<int>(machine::Real().call(SYS_openat, AT_FDCWD, path, flags, mode));
  if (descriptor >= 0 && folder) disk::Now().open[descriptor] = path;
  return descriptor;
}

ssize_t write(int descriptor, const void* bytes, size_t count) {
  if (Scheduler* const here = Scheduler::Get()) {
    here->Stir();
    if (!PathOf(descriptor).empty()) {
      if (const int error = disk::Call({ENOSPC, EIO, EDQUOT})) {
        // A part of it is there.
        (void)!machine::Real().call(SYS_write, descriptor, bytes, here->chance.Below(count + 1));
        return Failed(error);
      }
      if (count > 1 && here->chance.OneIn(16)) count = 1 + here->chance.Below(count);  // not all of it at once
    }
  }
  return machine::Real().call(SYS_write, descriptor, bytes, count);
}

int fsync(int descriptor) {
  const std::string path = PathOf(descriptor);
  if (path.empty()) return static_cast<int>(machine::Real().call(SYS_fsync, descriptor));
  if (const int error = disk::Call({EIO, ENOSPC})) return Failed(error);
  path == disk::Now().folder ? disk::FlushFolder() : disk::Flush(path);
  return 0;
}

int rename(const char* from, const char* to) {
  if (disk::Ours(from)) {
    if (const int error = disk::Call({EIO, ENOSPC})) return Failed(error);
  }
  const int status = static_cast<int>(machine::Real().call(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0));
  if (status == 0 && disk::Ours(from)) disk::NoteRename(from, to);
  return status;
}

int close(int descriptor) {
  if (Scheduler* const here = Scheduler::Get()) {
    here->Stir();
    here->timers.erase(descriptor);
    here->accepted.erase(descriptor);
    disk::Now().open.erase(descriptor);
  }
  return static_cast<int>(machine::Real().call(SYS_close, descriptor));
}
}  // extern "C"
