// A USB camera as its host sees it on the control endpoint: a UVC 1.1 device whose camera terminal moves the lens of a
// simulated world. Written from the class' own texts; shares nothing with the driver it is there to test.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "sim/scene.h"
#include "sim/world.h"

namespace lensd::sim::devices {

struct UvcOptions {
  std::string serial = "SIM1";
  bool isochronous = false;    ///< streams over an isochronous endpoint, otherwise over a bulk one
  bool asynchronous = false;   ///< focus settings return at once; the status endpoint tells the end of the motion
  bool echo = false;           ///< reading back tells the last setting, as most webcams do, not where the lens is
  bool relative_only = false;  ///< focus knows only nearer, farther and stop
  int grey_bits = 0;           ///< 10, 12 or 16: a third format has luminance alone, of so many bits
  bool auto_at_start = true;   ///< automatic focus and exposure are on when plugged in
};

/// What goes wrong with control requests to the camera terminal, each for the next `count` of them.
struct UvcFaults {
  int stall = 0;              ///< refused
  std::uint8_t error = 0xFF;  ///< what the error code control says of that
  int ignore = 0;             ///< settings acknowledged and not obeyed
  int lose = 0;               ///< obeyed, never answered
  int late = 0;               ///< obeyed, answered after `delay`
  Duration delay = std::chrono::seconds(2);
  int shorten = 0;  ///< readings come with a byte too few
};

/// One thread.
class UvcModel {
 public:
  struct Answer {
    enum class Kind { Done, Stall, Lost, Late };
    Kind kind = Kind::Done;
    std::vector<std::uint8_t> data;  ///< of an IN request; also of a late one
  };

  static constexpr std::uint8_t kTerminal = 1;
  static constexpr std::uint8_t kUnit = 2;  ///< processing
  static constexpr std::uint8_t kStreamEndpoint = 0x81;
  static constexpr std::uint8_t kStatusEndpoint = 0x83;
  static constexpr std::uint32_t kBulkPayload = 16384;
  static constexpr std::uint32_t kPacket = 3072;

  /// `clock` must outlive it. Errors as OpenWorld(). The scene's camera gives size and rate of the pictures; its lens
  /// at most 65536 steps.
  static Result<std::unique_ptr<UvcModel>> Create(std::shared_ptr<const Scene> scene, const Clock& clock,
                                                  const UvcOptions& options);

  /// The device is powered up: automatics and negotiated stream as they come from the factory.
  void Reset();
  /// Answers one control transfer; `setup` as on the wire.
  Answer Control(std::span<const std::uint8_t, 8> setup, std::span<const std::uint8_t> out);
  /// Packets of the status endpoint that have become due.
  std::vector<std::vector<std::uint8_t>> TakeStatus();

  std::vector<std::uint8_t> Configuration() const;

  UvcFaults& faults() { return faults_; }
  const UvcOptions& options() const { return options_; }
  const Scene& scene() const { return *scene_; }
  const std::shared_ptr<const Truth>& truth() const { return world_.truth; }
  drivers::Camera& camera() { return *world_.device.camera; }
  /// The stream agreed on is MJPEG.
  bool mjpeg() const { return stream_[2] == 2; }
  /// It is of luminance alone.
  bool grey() const { return stream_[2] == 3; }
  /// Counts negotiations: a new one starts a new stream.
  int commits() const { return commits_; }
  bool auto_focus() const { return auto_focus_ != 0; }
  std::uint8_t ae_mode() const { return ae_mode_; }
  /// Where the focus motor is, in steps, as the lens itself has it.
  double FocusPosition();

 private:
  struct Range {
    std::uint32_t minimum = 0, maximum = 0, resolution = 1, standard = 0;
  };
  struct Request {
    std::uint8_t type, code, selector, entity, interface;
    std::uint16_t length;
    std::span<const std::uint8_t> out;
  };

  UvcModel(std::shared_ptr<const Scene> scene, World world, UvcOptions options);

  Answer Standard(std::span<const std::uint8_t, 8> setup);
  Answer Spoiled(const Request& request);
  Answer Terminal(const Request& request);
  Answer Streaming(const Request& request);
  Answer Refuse(std::uint8_t error);
  Answer Absolute(const Request& request, drivers::Axis axis);
  Answer Exposure(const Request& request);
  Answer Gain(const Request& request);
  Answer FocusRelative(const Request& request);
  Answer Switch(const Request& request, std::uint8_t& value, std::uint8_t legal, std::uint8_t standard);
  std::optional<Answer> Describe(const Request& request, const Range& range, std::uint8_t info, std::size_t length);

  bool Has(std::uint8_t selector) const;
  Range RangeOf(drivers::Axis axis) const;
  std::uint32_t Current(drivers::Axis axis);
  void MoveTo(drivers::Axis axis, std::uint32_t value);
  bool ByHand(drivers::Axis axis) const;
  std::vector<std::uint8_t> Negotiated(std::span<const std::uint8_t> asked) const;

  const std::shared_ptr<const Scene> scene_;
  World world_;
  const UvcOptions options_;
  UvcFaults faults_;
  std::uint8_t auto_focus_ = 1;
  std::uint8_t ae_mode_ = 2;
  std::uint8_t error_ = 0;
  struct {
    std::uint32_t exposure = 0;  ///< 100 us
    std::uint32_t gain = 0;      ///< 0.1 dB
  } image_;
  drivers::PerAxis<std::uint32_t> set_{};  ///< last setting
  bool announce_ = false;                  ///< the end of the focus motion is still to be told
  std::vector<std::uint8_t> stream_;       ///< probe and commit
  int commits_ = 0;
};

}  // namespace lensd::sim::devices
