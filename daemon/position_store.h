// Remembered positions on disk: one small JSON file for each lens in the state folder.
#pragma once

#include <string>

#include "rig/position_memory.h"

namespace lensd::daemon {

/// FOLDER/NAME[-SERIAL].position.json, keyed by the lens' name and, where it has one, its serial number: another lens
/// under the same name starts with nothing remembered. Always whole: replaced by way of a temporary file that is
/// flushed before it takes the name, and the folder after.
class PositionStore final : public rig::PositionMemory {
 public:
  PositionStore(const std::string& folder, const std::string& lens, const std::string& serial);

  Result<Axes> Load() override;
  Result<void> Save(const Axes& axes) override;

  const std::string& path() const { return path_; }

 private:
  std::string lens_;
  std::string serial_;
  std::string path_;
};

}  // namespace lensd::daemon
