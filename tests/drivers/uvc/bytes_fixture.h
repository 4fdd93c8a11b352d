// One session on a wire that expects every byte.
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "scripted_transport.h"
#include "session.h"
#include "stream_choice.h"
#include "uvc_camera.h"
#include "uvc_lens.h"

namespace lensd::drivers::uvc {

inline constexpr std::uint32_t kFocusBits = 1u << 5 | 1u << 17;

class UvcBytes : public ::testing::Test {
 protected:
  void Begin(std::uint32_t controls, VideoFunction function = {}) {
    function.version = 0x0110;
    session_ = std::make_shared<Session>(wire_, clock_, std::move(function), CameraTerminal{1, controls},
                                         Identity{"webcam", "A1"}, ControlOptions{});
  }
  Result<std::unique_ptr<Lens>> OpenLens(const LensConfig& config = {}) {
    return UvcLens::Open(session_, config, findings_);
  }
  /// Range of the focus: 0..1023 as in section 8, now at 300.
  void ExpectFocusRange(const std::string& info = "03") {
    wire_->ExpectIn("A1 86 00 06 00 01 01 00", info);
    wire_->ExpectIn("A1 82 00 06 00 01 02 00", "00 00");
    wire_->ExpectIn("A1 83 00 06 00 01 02 00", "FF 03");
    wire_->ExpectIn("A1 84 00 06 00 01 02 00", "01 00");
    wire_->ExpectIn("A1 81 00 06 00 01 02 00", "2C 01");
  }

  SteppedClock clock_;
  std::shared_ptr<ScriptedTransport> wire_ = std::make_shared<ScriptedTransport>(clock_);
  std::shared_ptr<Session> session_;
  Findings findings_;
};

}  // namespace lensd::drivers::uvc
