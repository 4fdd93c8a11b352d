// A file is replaced by writing a temporary one beside it, flushing it and its folder, and renaming. A crash at any
// point leaves the old file or the new one.
#include "io/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

namespace lensd::io {
namespace {

std::unexpected<Error> FailAt(const std::string& path, std::string_view doing, int error) {
  return Fail(Code::Io, path + ": " + std::string(doing) + ": " + std::strerror(error));
}

/// Closes a descriptor, and removes the temporary file it belongs to unless that has been renamed.
class Temporary {
 public:
  Temporary(int descriptor, std::string path) : descriptor_(descriptor), path_(std::move(path)) {}
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;
  ~Temporary() {
    if (descriptor_ >= 0) close(descriptor_);
    if (!path_.empty()) unlink(path_.c_str());
  }
  int descriptor() const { return descriptor_; }
  const std::string& path() const { return path_; }
  int Close() { return close(std::exchange(descriptor_, -1)); }
  void Keep() { path_.clear(); }

 private:
  int descriptor_;
  std::string path_;
};

bool WriteAll(int descriptor, std::string_view contents) {
  while (!contents.empty()) {
    const ssize_t written = write(descriptor, contents.data(), contents.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    contents.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

/// Read once, before there are threads: it can only be read by changing it.
const mode_t kMask = [] {
  const mode_t mask = umask(0);
  umask(mask);
  return mask;
}();

/// mkstemp() makes files that only their owner may read.
mode_t ModeFor(const std::string& path) {
  struct stat old{};
  if (stat(path.c_str(), &old) == 0) return old.st_mode & 07777;
  return 0644 & ~kMask;
}

Result<void> FlushFolder(const std::filesystem::path& folder) {
  const std::string name = folder.empty() ? "." : folder.string();
  const int descriptor = open(name.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const bool flushed = descriptor >= 0 && fsync(descriptor) == 0;
  const int error = errno;
  if (descriptor >= 0) close(descriptor);
  if (!flushed) return FailAt(name, "written, but not certain to outlive a power cut", error);
  return {};
}

}  // namespace

Result<void> WriteFileAtomically(const std::string& asked, std::string_view contents) {
  std::error_code unresolved;
  const bool link = std::filesystem::is_symlink(asked, unresolved);
  std::filesystem::path target = asked;
  if (link) target = std::filesystem::weakly_canonical(asked, unresolved);
  if (unresolved && link) return FailAt(asked, "cannot be resolved", unresolved.value());
  std::string name = (target.parent_path() / ("." + target.filename().string() + ".XXXXXX")).string();
  const int descriptor = mkostemp(name.data(), O_CLOEXEC);
  if (descriptor < 0) return FailAt(asked, "cannot make a file beside it", errno);
  Temporary file(descriptor, name);
  if (fchmod(descriptor, ModeFor(target)) != 0) return FailAt(asked, "cannot set its permissions", errno);
  if (!WriteAll(descriptor, contents)) return FailAt(asked, "cannot be written", errno);
  if (fsync(descriptor) != 0) return FailAt(asked, "cannot be flushed to disk", errno);
  if (file.Close() != 0) return FailAt(asked, "cannot be closed", errno);
  if (rename(file.path().c_str(), target.c_str()) != 0) return FailAt(asked, "cannot be replaced", errno);
  file.Keep();
  return FlushFolder(target.parent_path());
}

Result<std::string> ReadWholeFile(const std::string& path, std::size_t limit) {
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return Fail(Code::Io, path + ": " + std::strerror(errno));
  const Temporary file(descriptor, "");
  std::string text;
  char piece[1 << 16];
  for (;;) {
    const ssize_t got = read(descriptor, piece, sizeof piece);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return Fail(Code::Io, path + ": " + std::strerror(errno));
    if (got == 0) return text;
    if (text.size() + static_cast<std::size_t>(got) > limit) return Fail(Code::BadData, path + ": is too large");
    text.append(piece, static_cast<std::size_t>(got));
  }
}

}  // namespace lensd::io
