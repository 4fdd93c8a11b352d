// hidapi over hidraw. hidapi 0.13 must neither enumerate (it may dereference a device that has just gone) nor close a
// handle that another thread reads: nodes are found by libudev, one thread owns the handle, and reads are short.
#include <hidapi.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <mutex>

#include "drivers/hotplug/nodes.h"
#include "transport.h"

namespace lensd::drivers::lensconnect {
namespace {

/// How late an interrupt may be noticed.
constexpr Duration kSlice = std::chrono::milliseconds(10);

struct CloseHid {
  void operator()(hid_device* device) const { hid_close(device); }
};

class HidrawTransport final : public Transport {
 public:
  HidrawTransport(hid_device* device, std::string path) : device_(device), path_(std::move(path)) {}

  Result<void> Write(std::span<const std::uint8_t> report) override {
    errno = 0;
    if (hid_write(device_.get(), report.data(), report.size()) >= 0) return {};
    return PassOn(Why("writing a report"));
  }

  Result<std::size_t> Read(std::span<std::uint8_t> buffer, Duration patience) override {
    for (;;) {
      if (interrupted_.exchange(false)) return Fail(Code::Cancelled, "interrupted");
      const Duration slice = std::min(patience, kSlice);
      const auto wait = std::chrono::ceil<std::chrono::milliseconds>(slice);
      const int count = hid_read_timeout(device_.get(), buffer.data(), buffer.size(), static_cast<int>(wait.count()));
      if (count < 0) return Gone();
      patience -= slice;
      if (count > 0 || patience <= Duration::zero()) return static_cast<std::size_t>(count);
    }
  }

  Result<void> SetFeature(std::span<const std::uint8_t> report) override {
    errno = 0;
    if (hid_send_feature_report(device_.get(), report.data(), report.size()) >= 0) return {};
    return PassOn(Why("setting a feature report"));
  }

  Result<std::size_t> GetFeature(std::span<std::uint8_t> buffer) override {
    errno = 0;
    const int count = hid_get_feature_report(device_.get(), buffer.data(), buffer.size());
    if (count >= 0) return static_cast<std::size_t>(count);
    return PassOn(Why("getting a feature report"));
  }

  void Interrupt() override { interrupted_ = true; }
  void BeginCall() override { interrupted_ = false; }

 private:
  std::unexpected<Error> Gone() const { return Fail(Code::Disconnected, path_ + " has been unplugged"); }

  /// A failed transfer, or no device any more: only then has the node hung up.
  Error Why(const std::string& what) {
    const int reason = errno;
    std::uint8_t ignored[64];
    const bool hung_up = hid_read_timeout(device_.get(), ignored, sizeof ignored, 0) < 0;
    if (hung_up || reason == ENODEV || reason == ENXIO || reason == ESHUTDOWN) return Gone().error();
    return {Code::Protocol, path_ + ": " + what + " failed: " + (reason != 0 ? std::strerror(reason) : "unknown")};
  }

  std::unique_ptr<hid_device, CloseHid> device_;
  std::string path_;
  std::atomic<bool> interrupted_{false};
};

}  // namespace

Result<std::unique_ptr<Transport>> OpenHidraw(const std::string& path) {
  static std::mutex library;  // opening touches what hidapi keeps for the whole process
  const std::lock_guard lock(library);
  errno = 0;
  hid_device* device = hid_open_path(path.c_str());
  const int reason = errno;
  if (device != nullptr) return std::make_unique<HidrawTransport>(device, path);
  if (std::string problem = hotplug::AccessProblem(path); !problem.empty() && reason != ENOENT) {
    return Fail(Code::Io, std::move(problem));
  }
  return Fail(Code::Disconnected, "cannot open " + path + ": " + std::strerror(reason != 0 ? reason : ENODEV));
}

}  // namespace lensd::drivers::lensconnect
