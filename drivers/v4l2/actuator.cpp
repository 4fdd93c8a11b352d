// The last step of a code on its way: a V4L2 control or a DW9714's register over I2C.
#include "actuator.h"

#include <linux/i2c-dev.h>
#include <linux/i2c.h>

#include <cerrno>
#include <cstring>
#include <sstream>
#include <utility>

namespace lensd::drivers::v4l2 {
namespace {

constexpr std::int64_t kTopCode = 1023;

class Dw9714 final : public Actuator {
 public:
  Dw9714(Node node, std::string name, bool plain) : node_(std::move(node)), name_(std::move(name)), plain_(plain) {}

  CodeRange range() const override { return {0, kTopCode, 1}; }

  /// On the wire: address, high byte, low byte. That is what SMBus calls writing a byte to a register, which every bus
  /// offers, the simplest ones included.
  Result<void> Write(std::int64_t code) override {
    const auto word = static_cast<std::uint16_t>(code << 4);
    i2c_smbus_data data{};
    data.byte = static_cast<__u8>(word & 0xff);
    i2c_smbus_ioctl_data request{};
    request.read_write = I2C_SMBUS_WRITE;
    request.command = static_cast<__u8>(word >> 8);
    request.size = I2C_SMBUS_BYTE_DATA;
    request.data = &data;
    if (const int status = node_.Ioctl(I2C_SMBUS, &request); status < 0) return Failure(-status);
    return {};
  }

  Result<std::optional<std::int64_t>> Read() override {
    if (!plain_) return Present();
    std::uint8_t bytes[2] = {};
    const int count = node_.kernel().Read(node_.fd(), bytes, sizeof bytes);
    if (count < 0) return Failure(-count);
    if (count != 2) return Fail(Code::Protocol, name_ + " answered " + std::to_string(count) + " bytes instead of 2");
    return (bytes[0] << 8 | bytes[1]) >> 4 & kTopCode;
  }

 private:
  /// A bus without plain transfers tells no more than that a chip acknowledges its address.
  Result<std::optional<std::int64_t>> Present() const {
    i2c_smbus_data data{};
    i2c_smbus_ioctl_data request{};
    request.read_write = I2C_SMBUS_READ;
    request.size = I2C_SMBUS_BYTE;
    request.data = &data;
    if (const int status = node_.Ioctl(I2C_SMBUS, &request); status < 0) return Failure(-status);
    return std::optional<std::int64_t>();
  }

  /// Drivers of buses disagree on how to say that the chip did not acknowledge.
  std::unexpected<Error> Failure(int error) const {
    if (error == ENXIO || error == EREMOTEIO || error == ENODEV) {
      return Fail(Code::Disconnected, name_ + " does not answer: " + std::strerror(error));
    }
    return KernelError(error, name_);
  }

  const Node node_;
  const std::string name_;
  const bool plain_;
};

}  // namespace

Result<std::optional<std::int64_t>> ControlActuator::Read() {
  if (control_.readable) {
    const auto value = GetControl(*node_, control_);
    if (!value) return PassOn(value);
    return *value;
  }
  // Asking what the control is disturbs nothing and tells whether the device is still there.
  const auto found = FindControl(*node_, control_.id);
  if (!found) return PassOn(found);
  return std::optional<std::int64_t>();
}

Result<std::unique_ptr<Actuator>> OpenDw9714(Kernel& kernel, const std::string& bus, std::uint16_t address) {
  std::ostringstream name;
  name << "the DW9714 at 0x" << std::hex << address << " of " << bus;
  auto node = Node::Open(kernel, bus);
  if (!node) return PassOn(node);
  unsigned long offers = 0;
  if (const int status = node->Ioctl(I2C_FUNCS, &offers); status < 0) {
    return Fail(Code::Unsupported, bus + " is no I2C bus: " + std::strerror(-status));
  }
  if ((offers & I2C_FUNC_SMBUS_WRITE_BYTE_DATA) == 0) return Fail(Code::Unsupported, bus + " cannot write two bytes");
  // NOLINTNEXTLINE(performance-no-int-to-ptr): the request takes its argument in place of a pointer.
  const int status = node->Ioctl(I2C_SLAVE, reinterpret_cast<void*>(std::uintptr_t{address}));
  if (status == -EBUSY) {
    return Fail(Code::Busy, "a kernel driver has " + name.str() + "; use its lens node instead: device or sensor");
  }
  if (status < 0) return KernelError(-status, name.str());
  auto chip = std::make_unique<Dw9714>(std::move(*node), name.str(), (offers & I2C_FUNC_I2C) != 0);
  if (const auto answer = chip->Read(); !answer) return PassOn(answer);
  return chip;
}

}  // namespace lensd::drivers::v4l2
