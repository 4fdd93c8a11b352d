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

/// Closes what it holds.
class Open {
 public:
  explicit Open(int descriptor) : descriptor_(descriptor) {}
  Open(const Open&) = delete;
  Open& operator=(const Open&) = delete;
  ~Open() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  int Close() { return close(std::exchange(descriptor_, -1)); }

 private:
  int descriptor_;
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

Result<WrittenFile> WrittenFile::Create(const std::string& asked, std::string_view contents) {
  std::error_code unresolved;
  const bool link = std::filesystem::is_symlink(asked, unresolved);
  std::filesystem::path target = asked;
  if (link) target = std::filesystem::weakly_canonical(asked, unresolved);
  if (unresolved && link) return FailAt(asked, "cannot be resolved", unresolved.value());
  std::string name = (target.parent_path() / ("." + target.filename().string() + ".XXXXXX")).string();
  const int descriptor = mkostemp(name.data(), O_CLOEXEC);
  if (descriptor < 0) return FailAt(asked, "cannot create a file beside it", errno);
  Open open(descriptor);
  WrittenFile file;
  file.asked_ = asked;
  file.target_ = target.string();
  file.temporary_ = name;
  if (fchmod(descriptor, ModeFor(target)) != 0) return FailAt(asked, "cannot set its permissions", errno);
  if (!WriteAll(descriptor, contents)) return FailAt(asked, "cannot be written", errno);
  if (fsync(descriptor) != 0) return FailAt(asked, "cannot be flushed to disk", errno);
  if (open.Close() != 0) return FailAt(asked, "cannot be closed", errno);
  return file;
}

WrittenFile::WrittenFile(WrittenFile&& other) noexcept
    : asked_(std::move(other.asked_)),
      target_(std::move(other.target_)),
      temporary_(std::exchange(other.temporary_, {})) {}

WrittenFile::~WrittenFile() {
  if (!temporary_.empty()) unlink(temporary_.c_str());
}

Result<void> WrittenFile::Replace() {
  if (rename(temporary_.c_str(), target_.c_str()) != 0) return FailAt(asked_, "cannot be replaced", errno);
  temporary_.clear();
  return FlushFolder(std::filesystem::path(target_).parent_path());
}

Result<void> WriteFileAtomically(const std::string& path, std::string_view contents) {
  auto file = WrittenFile::Create(path, contents);
  if (!file) return PassOn(file);
  return file->Replace();
}

Result<std::string> ReadWholeFile(const std::string& path, std::size_t limit) {
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return Fail(Code::Io, path + ": " + std::strerror(errno));
  const Open file(descriptor);
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
