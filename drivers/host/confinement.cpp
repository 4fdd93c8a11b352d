// Landlock for files, a seccomp filter for calls. Both last until the process ends, and all its threads have them.
#include "confinement.h"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/landlock.h>
#include <linux/seccomp.h>
#include <malloc.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <vector>

#include "drivers/wire/wire.h"
#include "loop/descriptor.h"

namespace lensd::drivers::host {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#elif defined(__has_feature)
constexpr bool kSanitized = __has_feature(address_sanitizer) || __has_feature(thread_sanitizer);
#else
constexpr bool kSanitized = false;
#endif

constexpr int kArenas = 2;  ///< each reserves 64 MiB of addresses, and by default each thread would have one

void Complain(const std::string& what, int error) {
  std::fprintf(stderr, "%s\n", (std::string(wire::kNotConfined) + what + ": " + std::strerror(error)).c_str());
}

void LimitMemory() {
  mallopt(M_ARENA_MAX, kArenas);
  if (kSanitized) return;  // their shadow memory takes terabytes of addresses
  const rlimit limit{kMemoryAtMost, kMemoryAtMost};
  if (setrlimit(RLIMIT_AS, &limit) != 0) Complain("the driver's memory has no limit", errno);
}

// ---- files ----------------------------------------------------------------------------------------------------------

constexpr std::uint64_t kRead = LANDLOCK_ACCESS_FS_READ_FILE, kList = LANDLOCK_ACCESS_FS_READ_DIR;
constexpr std::uint64_t kWrite = LANDLOCK_ACCESS_FS_WRITE_FILE;
constexpr std::uint64_t kTruncate = 1ULL << 14;  ///< LANDLOCK_ACCESS_FS_TRUNCATE, which the headers of Debian 12 lack

/// All that this version of Landlock can refuse; `version` is 1 or more.
std::uint64_t Refusable(long version) {
  const std::uint64_t first = (LANDLOCK_ACCESS_FS_MAKE_SYM << 1) - 1;
  return first | (version >= 2 ? std::uint64_t{LANDLOCK_ACCESS_FS_REFER} : 0) | (version >= 3 ? kTruncate : 0);
}

/// What is not there cannot be opened either. Rights of folders are left out for a file.
void Allow(const daemon::Descriptor& rules, std::uint64_t rights, const std::string& path) {
  const daemon::Descriptor there(open(path.c_str(), O_PATH | O_CLOEXEC));
  struct stat about{};
  if (!there || fstat(there.get(), &about) != 0) return;
  if (!S_ISDIR(about.st_mode)) rights &= ~kList;
  landlock_path_beneath_attr rule{};
  rule.allowed_access = rights;
  rule.parent_fd = there.get();
  syscall(SYS_landlock_add_rule, rules.get(), LANDLOCK_RULE_PATH_BENEATH, &rule, 0);
}

/// Every file may be read but for those in /dev, and none may be written.
void RefuseFiles(const std::vector<std::string>& paths) {
  const char* const lacking =
      "the driver may open every device and file that lensd may open, because Landlock is missing";
  const long version = syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
  if (version < 1) return Complain(lacking, errno);
  landlock_ruleset_attr all{};
  all.handled_access_fs = Refusable(version);
  const daemon::Descriptor rules(
      static_cast<int>(syscall(SYS_landlock_create_ruleset, &all, sizeof all.handled_access_fs, 0)));
  if (!rules) return Complain(lacking, errno);
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/", error)) {
    if (entry.path() != "/dev") Allow(rules, kRead | kList, entry.path());
  }
  Allow(rules, kList, "/dev");
  for (const char* name : {"/dev/null", "/dev/zero", "/dev/full", "/dev/random", "/dev/urandom"}) {
    Allow(rules, kRead | kWrite, name);
  }
  for (const std::string& path : paths)
    Allow(rules, (kRead | kWrite | kList | kTruncate) & all.handled_access_fs, path);
  if (syscall(SYS_landlock_restrict_self, rules.get(), 0) != 0) Complain(lacking, errno);
}

// ---- calls ----------------------------------------------------------------------------------------------------------

#if defined(__x86_64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_AARCH64;
#else
constexpr std::uint32_t kArchitecture = 0;
#endif

constexpr std::uint32_t kX32 = 0x40000000;  ///< calls by another name; no other architecture has so many

/// Other programs, and other processes' memory. io_uring opens sockets past every filter.
constexpr std::array kRefused = {
    SYS_execve,      SYS_execveat,       SYS_ptrace, SYS_process_vm_readv, SYS_process_vm_writev,
    SYS_pidfd_getfd, SYS_io_uring_setup, SYS_tkill,  SYS_pidfd_send_signal};
/// Their first argument is a process.
constexpr std::array kToItself = {SYS_kill, SYS_tgkill, SYS_rt_sigqueueinfo, SYS_rt_tgsigqueueinfo};

class Filter {
 public:
  void Load(std::size_t offset) { Add(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(offset)); }
  /// Its low half: both architectures begin with it.
  void LoadFirstArgument() { Load(offsetof(seccomp_data, args)); }
  /// The next `count` instructions are for a loaded value that equals `value`, or from it on.
  void If(std::uint32_t value, std::size_t count) { Jump(BPF_JEQ, value, 0, count); }
  void IfFrom(std::uint32_t value, std::size_t count) { Jump(BPF_JGE, value, 0, count); }
  void IfNot(std::uint32_t value, std::size_t count) { Jump(BPF_JEQ, value, count, 0); }
  void Accept() { Add(BPF_RET | BPF_K, SECCOMP_RET_ALLOW); }
  void Refuse(int error) { Add(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | static_cast<std::uint32_t>(error)); }

  /// False: with errno.
  bool Install() {
    sock_fprog program{static_cast<unsigned short>(code_.size()), code_.data()};
    return prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program, 0, 0) == 0;
  }

 private:
  void Add(int code, std::uint32_t value) { code_.push_back({static_cast<std::uint16_t>(code), 0, 0, value}); }
  void Jump(int how, std::uint32_t value, std::size_t equal, std::size_t other) {
    code_.push_back({static_cast<std::uint16_t>(BPF_JMP | BPF_K | how), static_cast<std::uint8_t>(equal),
                     static_cast<std::uint8_t>(other), value});
  }

  std::vector<sock_filter> code_;
};

void RefuseSockets(Filter& filter, bool network) {
  std::vector<int> families = {AF_UNIX, AF_NETLINK};  // udev and libusb hear of devices by netlink
  if (network) families.insert(families.end(), {AF_INET, AF_INET6});
  filter.If(SYS_socket, 2 + 2 * families.size());
  filter.LoadFirstArgument();
  for (const int family : families) {
    filter.If(static_cast<std::uint32_t>(family), 1);
    filter.Accept();
  }
  filter.Refuse(EAFNOSUPPORT);
}

void RefuseCalls(bool network) {
  const char* const lacking = "the driver may make every call that lensd may make, because seccomp filters are missing";
  if (kArchitecture == 0) return Complain(lacking, ENOSYS);
  Filter filter;
  filter.Load(offsetof(seccomp_data, arch));
  filter.IfNot(kArchitecture, 1);
  filter.Refuse(EPERM);
  filter.Load(offsetof(seccomp_data, nr));
  filter.IfFrom(kX32, 1);
  filter.Refuse(EPERM);
  for (const int call : kRefused) {
    filter.If(static_cast<std::uint32_t>(call), 1);
    filter.Refuse(EPERM);
  }
  for (const int call : kToItself) {
    filter.If(static_cast<std::uint32_t>(call), 4);
    filter.LoadFirstArgument();
    filter.If(static_cast<std::uint32_t>(getpid()), 1);
    filter.Accept();
    filter.Refuse(EPERM);
  }
  RefuseSockets(filter, network);
  filter.Accept();
  if (!filter.Install()) Complain(lacking, errno);
}

}  // namespace

void Confine(const Confinement& confinement) {
  LimitMemory();
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) Complain("the driver may gain privileges", errno);
  RefuseFiles(confinement.paths);
  RefuseCalls(confinement.network);
}

}  // namespace lensd::drivers::host
