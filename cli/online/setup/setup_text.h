// What `lensctl setup` finds, and how it is told.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/online/setup/setup_blur.h"

namespace lensd::cli {

/// What one run found, as --json prints it.
struct SetupFindings {
  varlink::Json info;                           ///< LensInfo
  varlink::Json axes = varlink::Json::array();  ///< one an axis
  varlink::Json autofocus, backlash;            ///< results of the interface, or null
  std::string direction = "untried";            ///< right, reversed, undecided; found: nobody had said any
  std::optional<std::string> seen;              ///< "nearPositive" or "nearNegative", where it was decided
  bool asked = false;                           ///< --at was given
  bool goes_by_seen = false;                    ///< lensd does
  double blur_px_per_step = 0.0;                ///< by the nominal optics; 0: not known
  double f_number = 0.0;                        ///< at which the blur was measured; 0: not known
  BlurSlope slope;                              ///< as measured
  std::optional<NominalCurve> curve;
  std::vector<std::string> remarks;
};

/// For people: every axis, focus, backlash, blur, direction and curve, then the lines for the configuration.
std::string SetupText(const SetupFindings& found);
/// What --json prints.
varlink::Json SetupJson(const SetupFindings& found, double elapsed_ms);

}  // namespace lensd::cli
