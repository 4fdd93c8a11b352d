// lens-run: drives any one driver alone, for people bringing up hardware.
#include <sysexits.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "daemon/config/drivers_table.h"
#include "drivers/api/device.h"
#include "io/png.h"
#include "lens_run_words.h"
#include "proto/errors_and_methods.h"

namespace lensd::tools {
namespace {

using drivers::Axis;

constexpr auto kLookEvery = std::chrono::milliseconds(5);
std::atomic<bool> stop_asked{false};

double Milliseconds(Duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

Result<Axis> AxisOf(const std::string& word) {
  const auto axis = drivers::AxisFromName(word);
  if (!axis) return Fail(Code::InvalidArgument, "\"" + word + "\" is no axis: focus, iris, zoom or filter");
  return *axis;
}

Result<double> NumberOf(const std::string& word) {
  double value = 0.0;
  const auto [rest, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || rest != word.data() + word.size() || !std::isfinite(value)) {
    return Fail(Code::InvalidArgument, "\"" + word + "\" is no number");
  }
  return value;
}

/// Runs the commands on one open device.
class Session {
 public:
  Session(drivers::Device device, const Clock& clock, double timeout_s)
      : device_(std::move(device)),
        clock_(clock),
        timeout_(std::chrono::duration_cast<Duration>(std::chrono::duration<double>(timeout_s))) {}

  Result<void> Do(const Command& command) {
    if (command.name == "list") return List();
    if (command.name == "read") return Read();
    if (command.name == "wait") return Wait(command.words[0]);
    if (command.name == "expose") return Expose(command.words[0]);
    if (command.name == "grab") return Grab(command.words[0]);
    if (command.name == "frames") return Frames(command.words[0]);
    return Move(command);
  }

 private:
  Result<void> List() const {
    if (device_.lens) {
      const drivers::Capabilities& can = device_.lens->capabilities();
      std::printf("lens    %s, %s%s%s\n", can.driver.c_str(), can.model.c_str(), can.serial.empty() ? "" : ", serial ",
                  can.serial.c_str());
      for (const Axis axis : drivers::kAxes) {
        if (can.axes[axis]) ListAxis(axis, *can.axes[axis]);
      }
    }
    if (device_.camera) {
      const drivers::CameraCapabilities& can = device_.camera->capabilities();
      std::printf("camera  %s, %s%s%s\n  %d x %d, %d bits, %g frames/s%s\n", can.driver.c_str(), can.model.c_str(),
                  can.serial.empty() ? "" : ", serial ", can.serial.c_str(), can.width, can.height, can.bits,
                  can.frame_rate_hz, can.can_set_exposure ? ", exposure can be set" : "");
    }
    return {};
  }

  static void ListAxis(Axis axis, const drivers::AxisCapabilities& can) {
    std::printf("  %-6s %g..%g %s in steps of %g, feedback: %s%s%s%s", std::string(drivers::AxisName(axis)).c_str(),
                can.minimum.value, can.maximum.value, std::string(drivers::NativeUnitName(can.unit)).c_str(),
                can.resolution, std::string(drivers::FeedbackName(can.feedback)).c_str(),
                can.can_stop ? "" : ", cannot stop midway", can.can_home ? ", can home" : "",
                can.needs_home ? ", must be homed" : "");
    if (can.speed > 0.0) std::printf(", %g/s", can.speed);
    if (can.settle > Duration::zero()) std::printf(", settles in %g ms", Milliseconds(can.settle));
    std::printf("\n");
  }

  Result<drivers::Lens*> TheLens() const {
    if (!device_.lens)
      return Fail(Code::Unsupported,
                  "there is no lens to move: the device has none, or parts = \"camera\" left it out");
    return device_.lens.get();
  }
  Result<drivers::Camera*> TheCamera() const {
    if (!device_.camera) return Fail(Code::Unsupported, "this device has no camera");
    return device_.camera.get();
  }

  static void PrintState(const drivers::LensState& state) {
    for (const Axis axis : drivers::kAxes) {
      if (!state.axes[axis]) continue;
      const drivers::AxisState& is = *state.axes[axis];
      std::printf("%s %.10g%s%s%s%s  ", std::string(drivers::AxisName(axis)).c_str(), is.position.value,
                  is.moving ? " moving" : "", is.homed ? "" : " not homed", is.fault.empty() ? "" : " FAULT ",
                  is.fault.c_str());
    }
    if (state.temperature) std::printf("%.1f C", state.temperature->value);
    std::printf("\n");
  }

  Result<void> Read() const {
    const auto lens = TheLens();
    if (!lens) return PassOn(lens);
    const auto state = (*lens)->Read();
    if (!state) return PassOn(state);
    PrintState(*state);
    return {};
  }

  Result<void> Move(const Command& command) const {
    const auto lens = TheLens();
    if (!lens) return PassOn(lens);
    const auto axis = AxisOf(command.words[0]);
    if (!axis) return PassOn(axis);
    const Instant begin = clock_.Now();
    Result<void> done;
    if (command.name == "home") {
      done = (*lens)->StartHome(*axis);
    } else if (command.name == "stop") {
      done = (*lens)->Stop(*axis);
    } else {
      const auto target = NumberOf(command.words[1]);
      if (!target) return PassOn(target);
      done = (*lens)->StartMove(*axis, Native{*target});
    }
    if (!done || command.name == "start") return done;
    return UntilAtRest(**lens, *axis, begin);
  }

  Result<void> UntilAtRest(drivers::Lens& lens, Axis axis, Instant begin) const {
    for (;;) {
      const auto state = lens.Read();
      if (!state) return PassOn(state);
      if (!state->axes[axis]->moving) {
        std::printf("%.1f ms  ", Milliseconds(clock_.Now() - begin));
        PrintState(*state);
        return {};
      }
      if (stop_asked) {
        (void)lens.Stop(axis);
        return Fail(Code::Cancelled, "stopped");
      }
      if (clock_.Now() - begin > timeout_) {
        return Fail(Code::Timeout, "the axis still moves, now at " + std::to_string(state->axes[axis]->position.value) +
                                       "; --timeout=S waits longer");
      }
      std::this_thread::sleep_for(kLookEvery);
    }
  }

  Result<void> Wait(const std::string& word) const {
    const auto seconds = NumberOf(word);
    if (!seconds) return PassOn(seconds);
    for (const Instant begin = clock_.Now(); Milliseconds(clock_.Now() - begin) < 1e3 * *seconds && !stop_asked;) {
      std::this_thread::sleep_for(kLookEvery);
    }
    return {};
  }

  Result<void> Expose(const std::string& word) const {
    const auto camera = TheCamera();
    if (!camera) return PassOn(camera);
    const auto ms = NumberOf(word);
    if (!ms) return PassOn(ms);
    if (!(*ms > 0.0 && *ms < 1e7)) return Fail(Code::InvalidArgument, "an exposure time is above 0 ms");
    return (*camera)->SetExposure(std::chrono::duration_cast<Duration>(std::chrono::duration<double, std::milli>(*ms)));
  }

  Result<drivers::Frame> Next(drivers::Camera& camera) const {
    const Instant begin = clock_.Now();
    for (;;) {
      auto frame = camera.Poll();
      if (!frame) return PassOn(frame);
      if (*frame) return **frame;
      if (stop_asked) return Fail(Code::Cancelled, "stopped");
      if (clock_.Now() - begin > timeout_) return Fail(Code::Timeout, "no frame came; --timeout=S waits longer");
      std::this_thread::sleep_for(kLookEvery);
    }
  }

  void PrintFrame(const drivers::Frame& frame) const {
    const auto [least, most] = std::ranges::minmax(*frame.samples);
    double sum = 0.0;
    for (const auto sample : *frame.samples) sum += sample;
    std::printf("frame %llu, %d x %d, %d bits: %u..%u, mean %.2f; exposed %.2f ms, until %.1f ms ago\n",
                static_cast<unsigned long long>(frame.sequence), frame.width, frame.height, frame.bits, unsigned{least},
                unsigned{most}, sum / static_cast<double>(frame.samples->size()),
                Milliseconds(frame.exposure_end - frame.exposure_start),
                Milliseconds(clock_.Now() - frame.exposure_end));
  }

  Result<void> Grab(const std::string& path) const {
    const auto camera = TheCamera();
    if (!camera) return PassOn(camera);
    if (auto started = (*camera)->Start(); !started) return started;
    const auto frame = Next(**camera);
    if (!frame) return PassOn(frame);
    PrintFrame(*frame);
    const auto colour = frame->colour ? frame->colour() : nullptr;
    io::Image image{.width = frame->width,
                    .height = frame->height,
                    .channels = colour ? 3 : 1,
                    .bits = frame->bits > 8 ? 16 : 8,
                    .samples = colour ? *colour : *frame->samples};
    // A viewer takes the file's full scale for white.
    if (frame->bits > 8 && frame->bits < 16) {
      for (auto& sample : image.samples) sample = static_cast<std::uint16_t>(sample << (16 - frame->bits));
    }
    if (auto written = io::WritePng(path, image); !written) return written;
    return (*camera)->Stop();
  }

  Result<void> Frames(const std::string& word) const {
    const auto camera = TheCamera();
    if (!camera) return PassOn(camera);
    const auto count = NumberOf(word);
    if (!count) return PassOn(count);
    if (auto started = (*camera)->Start(); !started) return started;
    for (int i = 0; i < *count; ++i) {
      const auto frame = Next(**camera);
      if (!frame) return PassOn(frame);
      PrintFrame(*frame);
    }
    return (*camera)->Stop();
  }

  drivers::Device device_;
  const Clock& clock_;
  const Duration timeout_;
};

int Complain(const Error& error) {
  std::fprintf(stderr, "lens-run: %s\n", error.message.c_str());
  return proto::ErrorOf(error.code).lens_run;
}

/// The drivers and what each finds.
int ListDrivers() {
  for (const drivers::Driver& driver : daemon::Drivers()) {
    std::printf("%s\n", std::string(driver.name).c_str());
    if (driver.probe == nullptr) continue;
    const auto found = driver.probe();
    if (!found) {
      std::printf("  cannot search: %s\n", found.error().message.c_str());
      continue;
    }
    for (const drivers::FoundDevice& device : *found) {
      std::printf("  %s%s%s  %s%s%s  %s%s%s\n", device.model.c_str(), device.serial.empty() ? "" : ", serial ",
                  device.serial.c_str(), device.lens ? "lens " : "", device.camera ? "camera " : "",
                  device.node.c_str(), device.config.c_str(),
                  device.problem.empty() ? "" : "  PROBLEM: ", device.problem.c_str());
    }
  }
  return EX_OK;
}

int Run(const std::vector<std::string>& arguments) {
  const auto asks = [&](std::string_view option) { return std::ranges::find(arguments, option) != arguments.end(); };
  if (asks("--help") || asks("-h")) {
    std::fputs(HelpText().c_str(), stdout);
    return EX_OK;
  }
  const auto script = ReadScript(arguments);
  if (!script) return Complain(script.error());
  if (script->driver.empty()) return ListDrivers();
  const drivers::Driver* driver = daemon::FindDriver(script->driver);
  if (driver == nullptr) {
    return Complain({Code::InvalidArgument,
                     "there is no driver \"" + script->driver + "\" in this build; it has " + daemon::DriverNames()});
  }
  const MonotonicClock clock;
  auto device = driver->open(script->settings, clock);
  if (!device) return Complain(device.error());
  for (const drivers::LeftOut& one : device->findings.left_out()) {
    std::fprintf(stderr, "%s is left out: %s\n", one.part.c_str(), one.reason.c_str());
  }
  for (const std::string& doubt : device->findings.doubts()) std::fprintf(stderr, "%s\n", doubt.c_str());
  Session session(std::move(*device), clock, script->timeout_s);
  for (const Command& command : script->commands) {
    if (auto done = session.Do(command); !done) return Complain(done.error());
    std::fflush(stdout);
  }
  return EX_OK;
}

}  // namespace
}  // namespace lensd::tools

int main(int argc, char** argv) {
  std::signal(SIGINT, [](int) { lensd::tools::stop_asked = true; });
  return lensd::tools::Run({argv + 1, argv + argc});
}
