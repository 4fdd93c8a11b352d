// A driver whose lens and camera go wrong in one call, as its settings say: `in` names the call, `how` what happens
// there.
#pragma once

#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>

#include "drivers/api/device.h"

namespace lensd::testing::odd {

using drivers::Axis;

class Trouble {
 public:
  Trouble(std::string in, std::string how, int lines) : in_(std::move(in)), how_(std::move(how)), lines_(lines) {}

  void Visit(const std::string& call) {
    if (call != in_) return;
    for (int i = 1; i <= lines_; ++i) std::printf("line %d\n", i);
    std::fflush(stdout);
    if (how_ == "segv") {
      signal(SIGSEGV, SIG_DFL);  // a sanitizer would make an exit status of its own of it
      raise(SIGSEGV);
    }
    if (how_ == "abort") std::abort();
    if (how_ == "kill") raise(SIGKILL);
    if (how_ == "exit") _exit(3);
    if (how_ == "throw") throw std::runtime_error("thrown on purpose");
    if (how_ == "spin") {
      for (volatile bool for_ever = true; for_ever;) continue;
    }
    if (how_ == "dawdle") std::this_thread::sleep_for(std::chrono::milliseconds(200));
    if (how_ == "deaf") std::this_thread::sleep_for(std::chrono::hours(1));
  }
  /// Waits until it is cut short. False: this call does not wait.
  bool WaitsFor(const std::string& call) {
    if (call != in_ || how_ != "wait") return false;
    std::unique_lock lock(mutex_);
    waits_ = true;
    std::printf("waiting in %s\n", call.c_str());
    std::fflush(stdout);
    cut_.wait(lock, [this] { return !waits_; });
    return true;
  }
  void Cut() {
    const std::lock_guard lock(mutex_);
    waits_ = false;
    cut_.notify_all();
  }

 private:
  const std::string in_, how_;
  const int lines_;
  std::mutex mutex_;  // guards waits_
  std::condition_variable cut_;
  bool waits_ = false;
};

inline drivers::Capabilities LensCan() {
  drivers::Capabilities can;
  can.driver = "odd";
  can.model = "odd lens";
  can.axes[Axis::Focus] = drivers::AxisCapabilities{.maximum = Native{1000.0}, .can_home = true};
  return can;
}

class OddLens final : public drivers::Lens {
 public:
  OddLens(std::shared_ptr<Trouble> trouble, const Clock& clock)
      : Lens(LensCan()), trouble_(std::move(trouble)), clock_(clock) {}
  ~OddLens() override {
    trouble_->Visit("Close");
    std::puts("closed");
  }

 private:
  Result<void> Done(const std::string& call) {
    trouble_->Visit(call);
    return {};
  }
  Result<void> DoStartHome(Axis) override { return Done("StartHome"); }
  Result<void> DoStartMove(Axis, Native target) override {
    if (trouble_->WaitsFor("StartMove")) return Fail(Code::Cancelled, "interrupted");
    at_ = target;
    return Done("StartMove");
  }
  Result<drivers::LensState> DoRead() override {
    if (trouble_->WaitsFor("Read")) return Fail(Code::Cancelled, "cut short");
    trouble_->Visit("Read");
    drivers::LensState state;
    state.sampled_at = clock_.Now();
    state.axes[Axis::Focus] = drivers::AxisState{.position = at_, .fault = {}};
    return state;
  }
  Result<void> DoStop(Axis) override { return Done("Stop"); }
  Result<void> DoResetFault(Axis) override { return Done("ResetFault"); }
  void DoInterrupt() override { trouble_->Cut(); }
  void DoCutReadShort() override { trouble_->Cut(); }

  const std::shared_ptr<Trouble> trouble_;
  const Clock& clock_;
  Native at_{0.0};
};

/// Samples beyond its bits.
class OddCamera final : public drivers::Camera {
 public:
  OddCamera(std::shared_ptr<Trouble> trouble, const Clock& clock)
      : Camera({.driver = "odd",
                .model = "odd camera",
                .serial = {},
                .width = 40,
                .height = 30,
                .bits = 10,
                .colour = true,
                .focus_region = {}}),
        trouble_(std::move(trouble)),
        clock_(clock) {}

 private:
  Result<void> DoStart() override {
    trouble_->Visit("StartStream");
    return {};
  }
  Result<void> DoStop() override {
    trouble_->Visit("StopStream");
    return {};
  }
  Result<std::optional<drivers::Frame>> DoPoll() override {
    trouble_->Visit("NextFrame");
    drivers::Frame frame;
    frame.width = capabilities().width;
    frame.height = capabilities().height;
    frame.bits = capabilities().bits;
    frame.sequence = ++sequence_;
    frame.exposure_start = frame.exposure_end = clock_.Now();
    const auto pixels = static_cast<std::size_t>(frame.width * frame.height);
    const auto first = static_cast<std::uint16_t>(1000 * sequence_);
    const auto picture = [first](std::size_t count) {
      auto samples = std::make_shared<std::vector<std::uint16_t>>(count);
      for (std::size_t i = 0; i < count; ++i) (*samples)[i] = static_cast<std::uint16_t>(first + i);
      return samples;
    };
    frame.samples = picture(pixels);
    frame.colour = [picture, pixels] { return picture(3 * pixels); };
    return frame;
  }
  drivers::Counters DoCount() const override { return {.frames = sequence_}; }

  const std::shared_ptr<Trouble> trouble_;
  const Clock& clock_;
  std::uint64_t sequence_ = 0;
};

inline Result<drivers::Device> Open(const Settings& settings, const Clock& clock) {
  SettingsReader read(settings, "driver \"odd\"");
  const std::string in = read.Text("in", "");
  const std::string how = read.Text("how", "");
  const auto lines = static_cast<int>(read.Integer("lines", 0, {0, 1e6}));
  if (auto done = read.Finish(); !done) return PassOn(done);
  auto trouble = std::make_shared<Trouble>(in, how, lines);
  trouble->Visit("Open");
  if (how == "refuse") return Fail(Code::Busy, "somebody else has it");
  drivers::Device device;
  device.lens = std::make_unique<OddLens>(trouble, clock);
  device.camera = std::make_unique<OddCamera>(trouble, clock);
  device.findings.LeaveOut("iris", {Code::Io, "it is loose"});
  return device;
}

inline constexpr drivers::Driver kDriver{.name = "odd", .open = Open};

}  // namespace lensd::testing::odd
