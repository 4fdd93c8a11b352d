// The simulated lens as a HID device of this kernel, through /dev/uhid.
#include <fcntl.h>
#include <linux/uhid.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <vector>

#include "sim/devices/lensconnect_uhid.h"

namespace lensd::sim::devices {
namespace {

constexpr std::uint16_t kBusUsb = 0x03;
constexpr int kLookEveryMs = 20;  ///< for the wish to stop

/// Every report of the bridge on a vendor's page, as arrays of bytes.
std::vector<std::uint8_t> Descriptor() {
  std::vector<std::uint8_t> bytes{0x06, 0x00, 0xFF, 0x09, 0x01, 0xA1, 0x01};
  const auto add = [&](std::uint8_t id, std::uint8_t length, std::uint8_t kind) {
    const std::uint8_t item[] = {0x85, id,   0x09, id,   0x15,   0x00, 0x26, 0xFF,
                                 0x00, 0x75, 0x08, 0x95, length, kind, 0x02};
    bytes.insert(bytes.end(), std::begin(item), std::end(item));
  };
  constexpr std::uint8_t kInput = 0x81, kOutput = 0x91, kFeature = 0xB1;
  const std::pair<std::uint8_t, std::uint8_t> features[] = {{0x01, 1},  {0x02, 4},  {0x03, 1}, {0x04, 2},
                                                            {0x05, 2},  {0x06, 13}, {0x20, 1}, {0x21, 9},
                                                            {0x22, 63}, {0x23, 63}, {0x24, 63}};
  for (const auto& [id, length] : features) add(id, length, kFeature);
  for (const std::uint8_t id : {0x10, 0x11, 0x12, 0x14, 0x15, 0x17}) add(id, 63, kOutput);
  for (const std::uint8_t id : {0x13, 0x16}) add(id, 63, kInput);
  bytes.push_back(0xC0);
  return bytes;
}

/// The event is packed: its arrays take no references.
void Copy(void* into, std::size_t size, const std::string& text) {
  std::memcpy(into, text.data(), std::min(text.size(), size - 1));
}

}  // namespace

LensConnectUhid::LensConnectUhid(LensConnectTraits traits, std::string serial)
    : serial_(std::move(serial)), lens_(std::move(traits), clock_) {}

LensConnectUhid::~LensConnectUhid() {
  Unplug();
}

Result<void> LensConnectUhid::Plug() {
  descriptor_ = open("/dev/uhid", O_RDWR | O_CLOEXEC);
  if (descriptor_ < 0) return Fail(Code::Io, std::string("/dev/uhid: ") + std::strerror(errno));
  uhid_event create{};
  create.type = UHID_CREATE2;
  Copy(create.u.create2.name, sizeof create.u.create2.name, "Computar LensConnect");
  Copy(create.u.create2.phys, sizeof create.u.create2.phys, "simulated");
  Copy(create.u.create2.uniq, sizeof create.u.create2.uniq, serial_);
  const auto descriptor = Descriptor();
  std::ranges::copy(descriptor, create.u.create2.rd_data);
  create.u.create2.rd_size = static_cast<__u16>(descriptor.size());
  create.u.create2.bus = kBusUsb;
  create.u.create2.vendor = 0x10C4;
  create.u.create2.product = 0x8D08;
  if (write(descriptor_, &create, sizeof create) < 0) {
    const std::string why = std::strerror(errno);
    close(std::exchange(descriptor_, -1));
    return Fail(Code::Io, "/dev/uhid: " + why);
  }
  thread_ = std::jthread([this](const std::stop_token& stop) { Serve(stop); });
  return {};
}

/// Closing the descriptor destroys the device.
void LensConnectUhid::Unplug() {
  if (descriptor_ < 0) return;
  thread_.request_stop();
  thread_.join();
  close(std::exchange(descriptor_, -1));
}

void LensConnectUhid::With(const std::function<void(LensConnect&)>& use) {
  const std::lock_guard lock(mutex_);
  use(lens_);
}

void LensConnectUhid::Serve(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    int wait = kLookEveryMs;
    {
      const std::lock_guard lock(mutex_);
      if (const auto next = lens_.NextInput()) {
        const auto in = std::chrono::ceil<std::chrono::milliseconds>(*next - clock_.Now());
        wait = static_cast<int>(std::clamp<std::int64_t>(in.count(), 0, kLookEveryMs));
      }
    }
    pollfd ready{descriptor_, POLLIN, 0};
    if (poll(&ready, 1, wait) > 0) {
      uhid_event event{};
      if (read(descriptor_, &event, sizeof event) > 0) Answer(event);
    }
    SendInput();
  }
}

void LensConnectUhid::Answer(const uhid_event& event) {
  const std::lock_guard lock(mutex_);
  uhid_event reply{};
  switch (event.type) {
    case UHID_OUTPUT:
      return lens_.Output(std::span(event.u.output.data, event.u.output.size));
    case UHID_SET_REPORT:
      lens_.SetFeature(std::span(event.u.set_report.data, event.u.set_report.size));
      reply.type = UHID_SET_REPORT_REPLY;
      reply.u.set_report_reply.id = event.u.set_report.id;
      return Write(reply);
    case UHID_GET_REPORT: {
      const auto feature = lens_.GetFeature(event.u.get_report.rnum);
      reply.type = UHID_GET_REPORT_REPLY;
      reply.u.get_report_reply.id = event.u.get_report.id;
      reply.u.get_report_reply.err = feature.empty() ? EIO : 0;
      reply.u.get_report_reply.size = static_cast<__u16>(feature.size());
      std::ranges::copy(feature, reply.u.get_report_reply.data);
      return Write(reply);
    }
    default:
      return;
  }
}

void LensConnectUhid::SendInput() {
  const std::lock_guard lock(mutex_);
  while (const auto report = lens_.TakeInput()) {
    uhid_event event{};
    event.type = UHID_INPUT2;
    event.u.input2.size = static_cast<__u16>(report->size());
    std::ranges::copy(*report, event.u.input2.data);
    Write(event);
  }
}

void LensConnectUhid::Write(const uhid_event& event) {
  (void)!write(descriptor_, &event, sizeof event);
}

}  // namespace lensd::sim::devices
