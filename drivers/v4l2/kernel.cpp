// System calls behind one interface with errno as Error, so that tests can play kernels that no packaged module shows.
#include "kernel.h"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>

#include "drivers/hotplug/waking.h"

namespace lensd::drivers::v4l2 {
namespace {

class Machine final : public Kernel {
 public:
  int Open(const std::string& path) override {
    const auto open_it = [&] { return open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC); };
    const int fd = drivers::hotplug::OpenInTurn(open_it);
    return fd < 0 ? -errno : fd;
  }
  void Close(int fd) override { close(fd); }
  int Ioctl(int fd, unsigned long request, void* argument) override {
    for (;;) {
      if (const int status = ioctl(fd, request, argument); status >= 0) return 0;
      if (errno != EINTR) return -errno;
    }
  }
  void* Map(int fd, std::size_t length, std::int64_t offset) override {
    void* memory = mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, fd, offset);
    return memory == MAP_FAILED ? nullptr : memory;
  }
  void Unmap(void* memory, std::size_t length) override { munmap(memory, length); }
  int Read(int fd, void* into, std::size_t length) override {
    const ssize_t count = read(fd, into, length);
    return count < 0 ? -errno : static_cast<int>(count);
  }
  std::vector<std::string> List(const std::string& folder, const std::string& prefix) override {
    std::vector<std::string> found;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
      if (entry.path().filename().string().starts_with(prefix)) found.push_back(entry.path().string());
    }
    // video2 before video10.
    std::ranges::sort(found,
                      [](const auto& a, const auto& b) { return std::pair(a.size(), a) < std::pair(b.size(), b); });
    return found;
  }
  std::string Text(const std::string& path) override {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
  }
};

Code CodeOf(int error) {
  switch (error) {
    case ENODEV:
    case ENOENT:
    case ENXIO:
    case ESHUTDOWN:
      return Code::Disconnected;
    case EBUSY:
      return Code::Busy;
    case ERANGE:
      return Code::OutOfRange;
    case ETIMEDOUT:
      return Code::Timeout;
    case ENOTTY:
    case EINVAL:
      return Code::Unsupported;
    case EACCES:
    case EPERM:
      return Code::Io;
    default:  // EIO, EREMOTEIO, EPIPE, EPROTO: trouble on the bus to the device
      return Code::Protocol;
  }
}

}  // namespace

Kernel& RealKernel() {
  static Machine machine;
  return machine;
}

std::unexpected<Error> KernelError(int error, const std::string& what) {
  std::string why = std::strerror(error);
  if (error == ENODEV || error == ESHUTDOWN) why = "the device has been unplugged";
  // What USB makes of a device that does not answer as it should; the words are those of other trades.
  if (error == EILSEQ || error == EPROTO || error == EPIPE) why = "the device refused it or its answer was damaged";
  return Fail(CodeOf(error), what + ": " + why);
}

Result<Node> Node::Open(Kernel& kernel, const std::string& path) {
  const int fd = kernel.Open(path);
  if (fd == -EACCES || fd == -EPERM) {
    return Fail(Code::Io,
                "no permission to read and write " + path + "; join the group that owns it, usually video or i2c");
  }
  if (fd < 0) return KernelError(-fd, path);
  Node node;
  node.kernel_ = &kernel;
  node.fd_ = fd;
  node.path_ = path;
  return node;
}

Node& Node::operator=(Node&& other) noexcept {
  std::swap(kernel_, other.kernel_);
  std::swap(fd_, other.fd_);
  std::swap(path_, other.path_);
  return *this;
}

Node::~Node() {
  if (fd_ >= 0) kernel_->Close(fd_);
}

}  // namespace lensd::drivers::v4l2
