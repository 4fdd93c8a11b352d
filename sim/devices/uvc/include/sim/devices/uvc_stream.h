// The pictures of a simulated USB camera, cut into payloads.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "base/result.h"
#include "drivers/api/camera.h"
#include "sim/devices/uvc_model.h"

namespace lensd::sim::devices {

/// What goes wrong with the next so many payloads.
struct StreamFaults {
  int flagged = 0;  ///< carry the error bit
  int dropped = 0;  ///< never sent
  int garbled = 0;  ///< sent with a header longer than themselves
};

/// One thread, that of the model. The world's camera streams from the first call until Stop().
class UvcStream {
 public:
  explicit UvcStream(UvcModel& model);
  ~UvcStream();

  /// The next payload, header included, at most `most` bytes. nullopt: no picture is exposed yet. Errors of the world's
  /// camera.
  Result<std::optional<std::vector<std::uint8_t>>> Next(std::size_t most);
  void Stop();

  StreamFaults& faults() { return faults_; }

 private:
  struct Encoder;
  std::vector<std::uint8_t> Encode(const drivers::Frame& frame);

  UvcModel& model_;
  StreamFaults faults_;
  std::unique_ptr<Encoder> encoder_;
  bool streaming_ = false;
  int commits_ = 0;
  bool frame_bit_ = false;
  std::vector<std::uint8_t> picture_;
  std::size_t sent_ = 0;
};

}  // namespace lensd::sim::devices
