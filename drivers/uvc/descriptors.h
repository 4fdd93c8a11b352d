// A camera's own description of itself: a walk through the bytes of its configuration descriptor (UVC 1.1 section 3 and
// the payload documents). Class-specific descriptors are taken wherever they stand after their interface, since some
// devices put them behind an endpoint.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "pixel_format.h"

namespace lensd::drivers::uvc {

/// The lens, the sensor's exposure: what a camera terminal can control.
struct CameraTerminal {
  std::uint8_t id = 0;
  std::uint32_t controls = 0;  ///< bmControls
  bool Has(int bit) const { return (controls >> bit & 1) != 0; }
};

/// What comes between sensor and stream: gain, brightness, colour.
struct ProcessingUnit {
  std::uint8_t id = 0;
  std::uint8_t source = 0;     ///< of its pictures: a terminal, or another unit
  std::uint32_t controls = 0;  ///< bmControls
  bool Has(int bit) const { return (controls >> bit & 1) != 0; }
};

struct StreamFrame {
  std::uint8_t index = 0;
  int width = 0;                         ///< px
  int height = 0;                        ///< px
  std::uint32_t default_interval = 0;    ///< 100 ns
  std::vector<std::uint32_t> intervals;  ///< 100 ns, the choices; a continuous range gives its two ends
  bool continuous = false;
};

struct StreamFormat {
  std::uint8_t index = 0;
  PixelFormat pixels = PixelFormat::Yuyv;
  std::uint8_t default_frame = 0;
  std::uint8_t transfer_characteristics = 0;  ///< of its colour matching descriptor; 0: not said
  std::vector<StreamFrame> frames;
};

/// One way of streaming: an alternate setting with its endpoint.
struct StreamSetting {
  std::uint8_t alternate = 0;
  std::uint8_t endpoint = 0;
  bool isochronous = false;
  std::uint32_t packet_bytes = 0;  ///< a (micro)frame, high-bandwidth multiples included
};

struct StreamInterface {
  std::uint8_t number = 0;
  std::vector<StreamFormat> formats;  ///< those this driver knows
  std::vector<StreamSetting> settings;
};

/// One video function: a control interface with what belongs to it.
struct VideoFunction {
  std::uint8_t interface = 0;  ///< VideoControl interface number
  std::uint16_t version = 0;   ///< bcdUVC
  std::vector<CameraTerminal> terminals;
  std::vector<ProcessingUnit> units;
  std::uint8_t status_endpoint = 0;  ///< address; 0: none
  std::uint16_t status_bytes = 0;
  std::vector<StreamInterface> streams;
};

/// The processing unit that has the gain of the pictures of `terminal`: the one that is fed by it, or else the first
/// that has one. nullptr: none.
const ProcessingUnit* UnitWithGain(const VideoFunction& function, const CameraTerminal& terminal);

/// The video functions of a configuration, each with the streaming interfaces its header names. Descriptors of other
/// classes and unknown formats are skipped. Protocol: a descriptor that does not fit into its own length or into the
/// bytes there are.
Result<std::vector<VideoFunction>> ParseConfiguration(std::span<const std::uint8_t> bytes);

}  // namespace lensd::drivers::uvc
