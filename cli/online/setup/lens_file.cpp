// The draft has a name that lensd does not read; link(2) then gives it its own, which fails where that exists.
#include "cli/online/setup/lens_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <thread>
#include <utility>

#include "cli/link/daemon_program.h"

namespace lensd::cli {
namespace {

/// The draft's name means nothing to the person: its mistakes are those of the file that it would have become.
std::expected<void, Failure> CheckDraft(const std::string& draft, const std::string& path) {
  auto [status, said] = RunDaemonProgram({"--check-config", "--config", draft}, STDERR_FILENO);
  if (status == 0) return {};
  if (status == 127) return Refuse(Exit::Unavailable, "lensd is not installed here, and it checks what is written");
  for (std::size_t at = 0; (at = said.find(draft, at)) != std::string::npos; at += path.size()) {
    said.replace(at, draft.size(), path);
  }
  if (said.empty()) said = "lensd --check-config failed with status " + std::to_string(status);
  return Refuse(Exit::Config, "nothing was added: " + said);
}

std::string WhyNot(const std::string& path) {
  return path + ": " + std::strerror(errno);
}

}  // namespace

std::string QuotedToml(const std::string& text) {
  std::string quoted = "\"";
  for (const char letter : text) {
    if (letter == '"' || letter == '\\') quoted += '\\';
    quoted += static_cast<unsigned char>(letter) < ' ' ? ' ' : letter;
  }
  return quoted + "\"";
}

std::string LensFileText(const NewLens& lens) {
  std::string text = "# Written by lensctl add.\nversion = 1\n";
  if (!lens.bus.empty()) text += "\n" + lens.bus;
  text += "\n[[lens]]\nname = " + QuotedToml(lens.name) + "\n" + lens.keys + lens.tables;
  if (!lens.optics.empty()) text += "[lens.optics]\n" + lens.optics;
  if (!lens.camera.empty()) text += "[lens.camera]\n" + lens.camera;
  return text;
}

std::string DropInFolder(const std::string& configuration) {
  return configuration + ".d";
}

std::expected<void, Failure> MayWriteInto(const std::string& folder) {
  std::error_code none;
  if (std::filesystem::exists(folder, none) && !std::filesystem::is_directory(folder, none)) {
    return Refuse(Exit::CannotWrite,
                  folder + " is no folder, and lensd reads the files *.toml of a folder of this name: rename it");
  }
  const std::string first =
      std::filesystem::exists(folder, none) ? folder : std::filesystem::path(folder).parent_path().string();
  if (access(first.c_str(), W_OK | X_OK) == 0) return {};
  const bool forbidden = errno == EACCES || errno == EPERM;
  const bool other_user = forbidden && geteuid() != 0;
  return Refuse(forbidden ? Exit::NotPermitted : Exit::CannotWrite,
                WhyNot(first) + (other_user ? ": this user may not write there: run sudo lensctl add" : ""));
}

std::expected<LensFile, Failure> LensFile::Prepare(const std::string& folder, const std::string& name,
                                                   const std::string& text, Duration patience) {
  LensFile file(folder, (std::filesystem::path(folder) / (name + ".toml")).string());
  if (auto locked = file.LockFolder(patience); !locked) return PassOn(locked);
  if (access(file.path_.c_str(), F_OK) == 0) {
    return Refuse(Exit::CannotWrite, file.path_ + " is there already and stays: choose another --name, or remove it");
  }
  std::string draft = file.path_ + ".XXXXXX";
  const int open_file = mkostemp(draft.data(), O_CLOEXEC);
  if (open_file < 0) return Refuse(Exit::CannotWrite, WhyNot(folder));
  file.draft_ = draft;
  const bool written = write(open_file, text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
                       fchmod(open_file, 0644) == 0 && fsync(open_file) == 0;
  const std::string why = written ? "" : WhyNot(draft);
  close(open_file);
  if (!written) return Refuse(Exit::CannotWrite, why);
  if (auto fine = CheckDraft(draft, file.path_); !fine) return PassOn(fine);
  return file;
}

// Another program may take the folder away again that it has created: then there is a new one to lock.
std::expected<void, Failure> LensFile::LockFolder(Duration patience) {
  constexpr Duration kTryEvery = std::chrono::milliseconds(50);
  const Instant deadline = MonotonicClock().Now() + patience;
  for (;;) {
    if (mkdir(folder_.c_str(), 0755) == 0) {
      created_ = true;
    } else if (errno != EEXIST) {
      return Refuse(Exit::CannotWrite, WhyNot(folder_));
    }
    lock_ = open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (lock_ < 0 && errno != ENOENT) return Refuse(Exit::CannotWrite, WhyNot(folder_));
    struct stat locked{}, named{};
    if (lock_ >= 0 && flock(lock_, LOCK_EX | LOCK_NB) == 0 && fstat(lock_, &locked) == 0 &&
        stat(folder_.c_str(), &named) == 0 && locked.st_dev == named.st_dev && locked.st_ino == named.st_ino) {
      return {};
    }
    if (lock_ >= 0) close(std::exchange(lock_, -1));
    if (MonotonicClock().Now() >= deadline) {
      return Refuse(Exit::Busy, folder_ + ": another lensctl add is still under way: try again when it has ended");
    }
    std::this_thread::sleep_for(kTryEvery);
  }
}

LensFile::LensFile(LensFile&& other) noexcept
    : folder_(std::move(other.folder_)),
      path_(std::move(other.path_)),
      draft_(std::exchange(other.draft_, {})),
      placed_(std::exchange(other.placed_, false)),
      created_(std::exchange(other.created_, false)),
      lock_(std::exchange(other.lock_, -1)) {}

LensFile::~LensFile() {
  TakeAway();
  if (lock_ >= 0) close(lock_);
}

std::expected<void, Failure> LensFile::Place() {
  if (link(draft_.c_str(), path_.c_str()) != 0) {
    return Refuse(Exit::CannotWrite,
                  errno == EEXIST ? path_ + " is there already and stays: choose another --name" : WhyNot(path_));
  }
  placed_ = true;
  unlink(draft_.c_str());
  draft_.clear();
  return {};
}

void LensFile::Keep() {
  placed_ = false;
  created_ = false;
}

void LensFile::TakeAway() {
  if (!draft_.empty()) unlink(draft_.c_str());
  if (placed_) unlink(path_.c_str());
  if (created_) rmdir(folder_.c_str());  // fails where somebody has put another file into it
  draft_.clear();
  placed_ = created_ = false;
}

}  // namespace lensd::cli
