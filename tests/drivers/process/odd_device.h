// Devices of the odd driver.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <mutex>
#include <string>
#include <vector>

#include "drivers/process/process.h"
#include "io/toml.h"

namespace lensd::drivers::process {

inline Program OddProgram() {
  return {.command = {LENSD_BINARY_DIR "/tests/odd-driver"}, .driver = "odd"};
}

inline Result<Device> OpenOdd(const std::string& toml, const Program& program = OddProgram()) {
  static const MonotonicClock clock;
  const auto settings = io::ParseToml(toml, "odd.toml");
  if (!settings) return PassOn(settings);
  return OpenInProcess(program, *settings, clock);
}

/// Lines as the log gets them. Any thread.
class Lines {
 public:
  void Add(std::string_view line) {
    const std::lock_guard lock(mutex_);
    lines_.emplace_back(line);
  }
  void Forget() {
    const std::lock_guard lock(mutex_);
    lines_.clear();
  }
  bool Have(const std::string& line) const {
    const std::lock_guard lock(mutex_);
    return std::find(lines_.begin(), lines_.end(), line) != lines_.end();
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> lines_;
};

}  // namespace lensd::drivers::process
