// USB Video Class: the numbers on the wire that this driver uses (UVC 1.1 sections 4.2.1, 4.2.2.1, 4.2.2.3, 4.3.1.1,
// A.8, A.9.5).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace lensd::drivers::uvc {

inline constexpr std::uint8_t kSetInterface = 0x21;  ///< bmRequestType: class request to an interface, out
inline constexpr std::uint8_t kGetInterface = 0xA1;  ///< in

inline constexpr std::uint8_t kSetCur = 0x01;
inline constexpr std::uint8_t kGetCur = 0x81;
inline constexpr std::uint8_t kGetMin = 0x82;
inline constexpr std::uint8_t kGetMax = 0x83;
inline constexpr std::uint8_t kGetRes = 0x84;
inline constexpr std::uint8_t kGetInfo = 0x86;

inline constexpr std::uint8_t kRequestErrorCode = 0x02;  ///< selector on entity 0
inline constexpr std::uint8_t kVsProbe = 0x01;           ///< selectors of a streaming interface
inline constexpr std::uint8_t kVsCommit = 0x02;

/// A control of the camera terminal, or of a processing unit.
struct UnitControl {
  std::uint8_t selector;
  std::uint16_t length;  ///< bytes
  int bit;               ///< in bmControls
};
inline constexpr UnitControl kAeMode{0x02, 1, 1};
inline constexpr UnitControl kExposureAbsolute{0x04, 4, 3};
inline constexpr UnitControl kFocusAbsolute{0x06, 2, 5};
inline constexpr UnitControl kFocusRelative{0x07, 2, 6};
inline constexpr UnitControl kFocusAuto{0x08, 1, 17};
inline constexpr UnitControl kIrisAbsolute{0x09, 2, 7};
inline constexpr UnitControl kZoomAbsolute{0x0B, 2, 9};

/// Of a processing unit: what its count means is the camera's own.
inline constexpr UnitControl kGain{0x04, 2, 9};

/// Values of AE mode: exposure time and iris are each either set by hand or by the camera.
inline constexpr std::uint8_t kAeManual = 1;
inline constexpr std::uint8_t kAeAuto = 2;
inline constexpr std::uint8_t kAeShutterPriority = 4;   ///< exposure by hand, iris by the camera
inline constexpr std::uint8_t kAeAperturePriority = 8;  ///< iris by hand, exposure by the camera

/// The setup stage of a control transfer.
struct Setup {
  std::uint8_t request_type = 0;
  std::uint8_t request = 0;
  std::uint16_t value = 0;
  std::uint16_t index = 0;
  std::uint16_t length = 0;

  bool in() const { return (request_type & 0x80) != 0; }
  /// As on the wire.
  std::array<std::uint8_t, 8> Bytes() const {
    const auto low = [](std::uint16_t word) { return static_cast<std::uint8_t>(word & 0xFF); };
    const auto high = [](std::uint16_t word) { return static_cast<std::uint8_t>(word >> 8); };
    return {request_type, request, low(value), high(value), low(index), high(index), low(length), high(length)};
  }
};

/// Little-endian, up to 4 bytes.
inline std::uint32_t FromLittle(std::span<const std::uint8_t> bytes) {
  std::uint32_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) value = value << 8 | bytes[i];
  return value;
}
/// A device may name any length: bytes after the fourth are 0.
inline std::vector<std::uint8_t> ToLittle(std::uint32_t value, std::size_t length) {
  std::vector<std::uint8_t> bytes(length);
  for (std::size_t i = 0; i < length && i < sizeof value; ++i) bytes[i] = static_cast<std::uint8_t>(value >> (8 * i));
  return bytes;
}

}  // namespace lensd::drivers::uvc
