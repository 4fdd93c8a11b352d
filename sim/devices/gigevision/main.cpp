// sim-gige-camera: the simulated camera as a program of its own.
#include <signal.h>
#include <sysexits.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <string>
#include <string_view>
#include <thread>

#include "sim/devices/gige_camera.h"

namespace {

constexpr const char* kUsage =
    "usage: sim-gige-camera --scene FILE.toml [--serial S] [--interface ADDRESS] [--lose FRACTION]\n"
    "                       [--names sfnc|sfnc-abort|basler|allied-vision|imaging-source|none] [--needs-initialize] "
    "[--seed N]\n"
    "                       [--position live|echo|at-end] [--echo MS] [--stale MS] [--busy-late MS] [--focus-zero "
    "near|far] "
    "[--print-description]\n"
    "A GigE Vision camera with a motorised lens before a simulated scene, until it is interrupted. Prints \"ready\".\n"
    "FocusStepper counts as the GenICam standard has it, 0 being the closest focus; with --focus-zero far it does the "
    "opposite.\n"
    "Each line \"focus STEPS\" on standard input, counted from the far end, sends the lens' focus there, as if "
    "something "
    "else turned it; \"truth\" prints where it really is, counted so.\n";

struct Arguments {
  lensd::sim::GigeOptions options;
  bool print = false;
};

bool Parse(int argc, char** argv, Arguments& arguments) {
  lensd::sim::GigeOptions& options = arguments.options;
  for (int i = 1; i < argc; ++i) {
    const std::string_view key = argv[i];
    if (key == "--needs-initialize") {
      options.needs_initialize = true;
      continue;
    }
    if (key == "--print-description") {
      arguments.print = true;
      continue;
    }
    if (i + 1 == argc) return false;
    const std::string_view value = argv[++i];
    const char* end = value.data() + value.size();
    if (key == "--scene") {
      options.scene = value;
    } else if (key == "--serial") {
      options.serial = value;
    } else if (key == "--interface") {
      options.interface = value;
    } else if (key == "--names") {
      options.names = value;
    } else if (key == "--lose") {
      if (std::from_chars(value.data(), end, options.lost_packets).ptr != end) return false;
    } else if (key == "--position") {
      constexpr std::string_view kKinds[] = {"live", "echo", "at-end"};
      const auto kind = std::ranges::find(kKinds, value);
      if (kind == std::end(kKinds)) return false;
      options.position = static_cast<lensd::sim::GigePosition>(kind - kKinds);
    } else if (key == "--focus-zero") {
      if (value != "near" && value != "far") return false;
      options.focus_zero = value == "near" ? lensd::sim::GigeFocusZero::Near : lensd::sim::GigeFocusZero::Far;
    } else if (key == "--busy-late" || key == "--echo" || key == "--stale") {
      double ms = 0.0;
      if (std::from_chars(value.data(), end, ms).ptr != end) return false;
      auto& time = key == "--echo" ? options.echo : key == "--stale" ? options.stale : options.busy_late;
      time = std::chrono::microseconds(std::llround(ms * 1e3));
    } else if (key == "--seed") {
      if (std::from_chars(value.data(), end, options.seed).ptr != end) return false;
    } else {
      return false;
    }
  }
  return !options.scene.empty();
}

/// Until the end of the input.
void Listen(lensd::sim::GigeCamera& camera) {
  for (std::string line; std::getline(std::cin, line);) {
    double steps = 0.0;
    if (std::sscanf(line.c_str(), "focus %lf", &steps) == 1) camera.PlaceFocus(steps);
    if (line == "truth") {
      std::printf("truth %.3f\n", camera.TrueFocus());
      std::fflush(stdout);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  if (!Parse(argc, argv, arguments)) {
    std::fputs(kUsage, stderr);
    return EX_USAGE;
  }
  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGINT);
  sigaddset(&ends, SIGTERM);
  sigprocmask(SIG_BLOCK, &ends, nullptr);  // before any thread: they inherit it
  const lensd::MonotonicClock clock;
  const auto camera = lensd::sim::GigeCamera::Start(arguments.options, clock);
  if (!camera) {
    std::fprintf(stderr, "sim-gige-camera: %s\n", camera.error().message.c_str());
    return camera.error().code == lensd::Code::Busy ? EX_UNAVAILABLE : EX_DATAERR;
  }
  if (arguments.print) {
    std::fputs((*camera)->description().c_str(), stdout);
    return EX_OK;
  }
  std::puts("ready");
  std::fflush(stdout);
  std::thread([&camera] { Listen(**camera); }).detach();
  int which = 0;
  sigwait(&ends, &which);
  _exit(EX_OK);  // the listener may be reading still; nothing here needs an orderly end
}
