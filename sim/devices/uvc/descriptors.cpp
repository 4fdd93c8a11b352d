// Device and configuration descriptors of the simulated camera by UVC 1.1, section 3, and USB 2.0, section 9.6.
#include "descriptors.h"

#include <cmath>
#include <initializer_list>

namespace lensd::sim::devices {
namespace {

using Bytes = std::vector<std::uint8_t>;

void Add(Bytes& bytes, std::initializer_list<int> values) {
  for (const int value : values) bytes.push_back(static_cast<std::uint8_t>(value));
}

/// Header, camera terminal, a processing unit with gain (the tenth bit), output terminal.
Bytes ControlUnits(std::uint32_t controls) {
  Bytes units;
  Add(units, {18, 0x24, 0x02, UvcModel::kTerminal, 0x01, 0x02, 0, 0, 0, 0, 0, 0, 0, 0, 3});
  Append(units, controls, 3);
  Add(units, {12, 0x24, 0x05, UvcModel::kUnit, UvcModel::kTerminal, 0, 0, 2, 0, 0x02, 0, 0});
  Add(units, {9, 0x24, 0x03, 3, 0x01, 0x01, 0, UvcModel::kUnit, 0});
  Bytes all;
  Add(all, {13, 0x24, 0x01, 0x10, 0x01});
  Append(all, static_cast<std::uint32_t>(13 + units.size()), 2);
  Append(all, 48'000'000, 4);
  Add(all, {1, 1});
  all.insert(all.end(), units.begin(), units.end());
  return all;
}

void AddFrame(Bytes& bytes, int subtype, const CameraSettings& camera) {
  const auto size = static_cast<std::uint32_t>(camera.width * camera.height * 2);
  const std::uint32_t interval = FrameInterval(camera);
  Add(bytes, {30, 0x24, subtype, 1, 0});
  Append(bytes, static_cast<std::uint32_t>(camera.width), 2);
  Append(bytes, static_cast<std::uint32_t>(camera.height), 2);
  const auto bits = static_cast<std::uint32_t>(size * 8.0 * camera.frame_rate_hz);
  Append(bytes, bits, 4);
  Append(bytes, bits, 4);
  Append(bytes, size, 4);
  Append(bytes, interval, 4);
  Add(bytes, {1});
  Append(bytes, interval, 4);
}

/// Linear light, as the simulated sensor has it.
void AddColour(Bytes& bytes) {
  Add(bytes, {6, 0x24, 0x0D, 1, 6, 4});
}

Bytes StreamFormats(const UvcOptions& options, const CameraSettings& camera) {
  Bytes formats;
  Add(formats, {27,   0x24, 0x04, 1,    1,    'Y',  'U',  'Y', '2', 0x00, 0x00, 0x10, 0x00, 0x80,
                0x00, 0x00, 0xAA, 0x00, 0x38, 0x9B, 0x71, 16,  1,   0,    0,    0,    0});
  AddFrame(formats, 0x05, camera);
  AddColour(formats);
  Add(formats, {11, 0x24, 0x06, 2, 1, 1, 1, 0, 0, 0, 0});
  AddFrame(formats, 0x07, camera);
  AddColour(formats);
  const int count = options.grey_bits > 0 ? 3 : 2;
  if (count == 3) {
    const std::string bits = std::to_string(options.grey_bits);
    Add(formats, {27,   0x24, 0x04, 3,    1,    'Y',  bits[0], bits[1], ' ', 0x00, 0x00, 0x10, 0x00, 0x80,
                  0x00, 0x00, 0xAA, 0x00, 0x38, 0x9B, 0x71,    16,      1,   0,    0,    0,    0});
    AddFrame(formats, 0x05, camera);
    AddColour(formats);
  }
  Bytes all;
  Add(all, {13 + count, 0x24, 0x01, count});
  Append(all, static_cast<std::uint32_t>(13 + count) + static_cast<std::uint32_t>(formats.size()), 2);
  Add(all, {UvcModel::kStreamEndpoint, 0, 3, 0, 0, 0, 1});
  all.insert(all.end(), static_cast<std::size_t>(count), std::uint8_t{0});
  all.insert(all.end(), formats.begin(), formats.end());
  return all;
}

}  // namespace

void Append(Bytes& bytes, std::uint32_t value, int length) {
  for (int i = 0; i < length; ++i) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

std::uint32_t FrameInterval(const CameraSettings& camera) {
  return static_cast<std::uint32_t>(std::lround(1e7 / camera.frame_rate_hz));
}

Bytes DeviceDescriptor() {
  // 1209:0001 is pid.codes' number for tests.
  Bytes bytes;
  Add(bytes, {18, 1, 0x00, 0x02, 0xEF, 2, 1, 64, 0x09, 0x12, 0x01, 0x00, 0x00, 0x01, 1, 2, 3, 1});
  return bytes;
}

Bytes ConfigurationDescriptor(const UvcOptions& options, std::uint32_t controls, const CameraSettings& camera) {
  Bytes body;
  Add(body, {8, 0x0B, 0, 2, 0x0E, 0x03, 0, 0});
  Add(body, {9, 4, 0, 0, 1, 0x0E, 0x01, 0, 0});
  const Bytes units = ControlUnits(controls);
  body.insert(body.end(), units.begin(), units.end());
  Add(body, {7, 5, UvcModel::kStatusEndpoint, 3, 16, 0, 8});
  Add(body, {5, 0x25, 0x03, 16, 0});
  Add(body, {9, 4, 1, 0, options.isochronous ? 0 : 1, 0x0E, 0x02, 0, 0});
  const Bytes formats = StreamFormats(options, camera);
  body.insert(body.end(), formats.begin(), formats.end());
  if (options.isochronous) {
    Add(body, {9, 4, 1, 1, 1, 0x0E, 0x02, 0, 0});
    // Three packets of 1024 bytes a microframe.
    Add(body, {7, 5, UvcModel::kStreamEndpoint, 5, 0x00, 0x14, 1});
  } else {
    Add(body, {7, 5, UvcModel::kStreamEndpoint, 2, 0x00, 0x02, 0});
  }
  Bytes all;
  Add(all, {9, 2});
  Append(all, static_cast<std::uint32_t>(9 + body.size()), 2);
  Add(all, {2, 1, 0, 0x80, 50});
  all.insert(all.end(), body.begin(), body.end());
  return all;
}

Bytes StringDescriptor(int index, const std::string& serial) {
  Bytes bytes = {0, 3};
  if (index == 0) {
    Append(bytes, 0x0409, 2);
  } else {
    const std::string text = index == 1 ? "lensd" : index == 2 ? "Simulated UVC camera" : serial;
    for (const char c : text) Append(bytes, static_cast<std::uint8_t>(c), 2);
  }
  bytes[0] = static_cast<std::uint8_t>(bytes.size());
  return bytes;
}

}  // namespace lensd::sim::devices
