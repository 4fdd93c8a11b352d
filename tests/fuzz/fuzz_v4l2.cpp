// A kernel that answers anything at all, within what system calls are bound to: sizes hold, pointers stay. Whatever is
// opened is closed, whatever is mapped is given back, and a frame has the samples that its size says.
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <linux/media.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "kernel.h"
#include "media.h"
#include "open.h"

namespace {

using namespace lensd;
using namespace lensd::drivers::v4l2;

class AnyKernel final : public Kernel {
 public:
  explicit AnyKernel(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  ~AnyKernel() override {
    if (!open_.empty() || !mapped_.empty()) __builtin_trap();
  }

  int Open(const std::string&) override {
    if (Byte() % 16 == 15) return -ENOENT;
    open_.insert(++last_);
    return last_;
  }
  void Close(int fd) override {
    if (open_.erase(fd) != 1) __builtin_trap();
  }
  int Ioctl(int fd, unsigned long request, void* argument) override {
    if (!open_.contains(fd)) __builtin_trap();
    constexpr int kErrors[] = {EINVAL, ENOTTY, EBUSY, EIO, ENODEV, EAGAIN, ENOSPC, ERANGE};
    const unsigned how = Byte();
    if (how % 8 == 7) return -kErrors[how / 8 % 8];
    switch (request) {
      case I2C_SLAVE:
        return 0;
      case I2C_FUNCS:
        Fill(argument, sizeof(unsigned long));
        return 0;
      case I2C_SMBUS:
        if (auto* transfer = static_cast<i2c_smbus_ioctl_data*>(argument); transfer->data != nullptr)
          Fill(transfer->data, 1);
        return 0;
      case VIDIOC_G_EXT_CTRLS:
      case VIDIOC_S_EXT_CTRLS:
        Values(*static_cast<v4l2_ext_controls*>(argument));
        return 0;
      case VIDIOC_QUERYBUF:
      case VIDIOC_QBUF:
      case VIDIOC_DQBUF:
        AnyBuffer(*static_cast<v4l2_buffer*>(argument));
        return 0;
      case VIDIOC_REQBUFS:
        Requested(*static_cast<v4l2_requestbuffers*>(argument));
        return 0;
      case MEDIA_IOC_G_TOPOLOGY:
        return Topology(*static_cast<media_v2_topology*>(argument));
      default:
        if (_IOC_DIR(request) & _IOC_READ) Fill(argument, _IOC_SIZE(request));
        return 0;
    }
  }
  void* Map(int, std::size_t length, std::int64_t) override {
    constexpr std::size_t kMost = std::size_t{1} << 18;
    if (length == 0 || length > kMost) return nullptr;
    auto memory = std::make_unique<std::uint8_t[]>(length);
    Fill(memory.get(), std::min<std::size_t>(length, 4096));
    void* const at = memory.get();
    mapped_[at] = {length, std::move(memory)};
    return at;
  }
  void Unmap(void* memory, std::size_t length) override {
    const auto found = mapped_.find(memory);
    if (found == mapped_.end() || found->second.first != length) __builtin_trap();
    mapped_.erase(found);
  }
  int Read(int, void* into, std::size_t length) override {
    if (Byte() % 4 == 3) return -EIO;
    const std::size_t count = std::min<std::size_t>(length, Byte());
    Fill(into, count);
    return static_cast<int>(count);
  }
  std::vector<std::string> List(const std::string& folder, const std::string& prefix) override {
    std::vector<std::string> found;
    const std::string begin = folder + "/" + prefix;
    for (unsigned i = 0; i < Byte() % 4U; ++i) found.push_back(begin + std::to_string(i));
    return found;
  }
  std::string Text(const std::string&) override {
    std::string text(Byte() % 64, ' ');
    Fill(text.data(), text.size());
    return (Byte() % 2 == 0 ? "DEVNAME=" : "") + text;
  }

 private:
  unsigned Byte() {
    if (bytes_.empty()) return 0;
    const unsigned byte = bytes_[0];
    bytes_ = bytes_.subspan(1);
    return byte;
  }
  /// What is left of the bytes, then nothing is changed.
  void Fill(void* to, std::size_t size) {
    const std::size_t count = std::min(size, bytes_.size());
    std::memcpy(to, bytes_.data(), count);
    bytes_ = bytes_.subspan(count);
  }
  void Values(v4l2_ext_controls& all) {
    for (__u32 i = 0; i < all.count; ++i) Fill(&all.controls[i].value64, sizeof all.controls[i].value64);
  }
  void AnyBuffer(v4l2_buffer& buffer) {
    const auto memory = buffer.m;
    const bool planes = V4L2_TYPE_IS_MULTIPLANAR(buffer.type);
    const __u32 length = buffer.length;
    Fill(&buffer, sizeof buffer);
    if (!planes) {
      buffer.m.offset = Byte();
      return;
    }
    buffer.m = memory;
    buffer.length = length;
    for (__u32 i = 0; i < length; ++i) Fill(&buffer.m.planes[i], sizeof buffer.m.planes[i]);
  }
  /// Any number of buffers would be asked for one by one.
  void Requested(v4l2_requestbuffers& request) { request.count = request.count == 0 ? 0 : Byte() % 8; }

  int Topology(media_v2_topology& topology) {
    const auto answer = [&](__u64 pointer, __u32 count, std::size_t each) -> std::optional<__u32> {
      const __u32 there = Byte() % 6;
      if (pointer != 0 && there > count) return std::nullopt;
      // NOLINTNEXTLINE(performance-no-int-to-ptr): media_v2_topology holds pointers as numbers.
      if (pointer != 0) Fill(reinterpret_cast<void*>(static_cast<std::uintptr_t>(pointer)), there * each);
      return there;
    };
    const auto entities = answer(topology.ptr_entities, topology.num_entities, sizeof(media_v2_entity));
    const auto interfaces = answer(topology.ptr_interfaces, topology.num_interfaces, sizeof(media_v2_interface));
    const auto links = answer(topology.ptr_links, topology.num_links, sizeof(media_v2_link));
    if (!entities || !interfaces || !links) return -ENOSPC;
    topology.num_entities = *entities;
    topology.num_interfaces = *interfaces;
    topology.num_links = *links;
    if (topology.ptr_entities != 0 && topology.num_entities > 1 && Byte() % 2 == 0) {
      // What only a graph of some sense reaches.
      // NOLINTNEXTLINE(performance-no-int-to-ptr): as above.
      auto* found = reinterpret_cast<media_v2_entity*>(static_cast<std::uintptr_t>(topology.ptr_entities));
      found[0].function = MEDIA_ENT_F_CAM_SENSOR;
      found[1].function = MEDIA_ENT_F_LENS;
    }
    return 0;
  }

  std::span<const std::uint8_t> bytes_;
  int last_ = 2;
  std::set<int> open_;
  std::map<void*, std::pair<std::size_t, std::unique_ptr<std::uint8_t[]>>> mapped_;
};

Config ConfigOf(unsigned byte) {
  Config config;
  switch (byte % 4) {
    case 0:
      config.device = "/dev/video0";
      break;
    case 1:
      config.sensor = "imx";
      break;
    case 2:
      config.i2c_bus = "/dev/i2c-1";
      config.chip = "dw9714";
      break;
    default:
      break;
  }
  if ((byte & 4U) != 0) config.parts = Parts::Lens;
  if ((byte & 8U) != 0) config.parts = Parts::Camera;
  if ((byte & 16U) != 0) config.frame_rate_hz = 30.0;
  return config;
}

void Use(drivers::Device& device, SteppedClock& clock) {
  if (device.lens) {
    for (const drivers::Axis axis : drivers::kAxes) {
      const auto& can = device.lens->capabilities().axes[axis];
      if (!can) continue;
      if (!(can->resolution > 0.0) || can->maximum < can->minimum) __builtin_trap();
      (void)device.lens->StartMove(axis, can->maximum);
    }
    for (int i = 0; i < 4; ++i) {
      (void)device.lens->Read();
      clock.Advance(std::chrono::milliseconds(7));
    }
    (void)device.lens->Stop(drivers::Axis::Focus);
  }
  if (device.camera && device.camera->Start()) {
    for (int i = 0; i < 4; ++i) {
      const auto frame = device.camera->Poll();
      if (frame && *frame) {
        const auto& one = **frame;
        if (one.samples->size() != static_cast<std::size_t>(one.width) * static_cast<std::size_t>(one.height))
          __builtin_trap();
        if (one.exposure_end < one.exposure_start) __builtin_trap();
      }
      clock.Advance(std::chrono::milliseconds(33));
    }
    (void)device.camera->Stop();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  SteppedClock clock;
  AnyKernel kernel({data + 1, size - 1});
  if (data[0] == 255) {
    const auto found = FindLensOfSensor(kernel, "imx");
    if (found && !found->starts_with("/dev/")) __builtin_trap();
    return 0;
  }
  auto device = OpenOn(kernel, ConfigOf(data[0]), clock);
  if (device) Use(*device, clock);
  return 0;
}
