// One lens as the service holds it.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lens_service.h"
#include "planning.h"
#include "retry.h"
#include "rig/calibration.h"
#include "rig/presets.h"

namespace lensd::daemon {

struct LensService::Lens {
  /// Who alone may move it.
  struct Lease {
    std::string key;
    const void* owner = nullptr;   ///< its connection; null: it ends with a time
    std::optional<Instant> until;  ///< when it ends
  };

  LensConfig config;
  std::string name;
  std::string info;                                     ///< LensInfo, serialised
  std::string text;                                     ///< LensStatus, serialised
  std::shared_ptr<const rig::Status> status;            ///< what `text` says
  std::optional<Planning> planning;                     ///< none: the optics are not known
  std::shared_ptr<const rig::OpticsTable> planned_for;  ///< what `planning` and `info` say
  std::string calibration_file;                         ///< where it is kept; empty: nowhere
  std::string presets_file;                             ///< empty: nowhere
  std::vector<rig::Preset> presets;                     ///< by label
  std::string presets_broken;                           ///< empty, or why their file cannot be read
  std::string published;                                ///< the worker's thread: last state it told of, to see changes
  std::optional<Lease> lease;
  std::unique_ptr<Worker> worker;  ///< none: the lens has not been there yet
  std::optional<Retry> retry;      ///< until then
};

}  // namespace lensd::daemon
