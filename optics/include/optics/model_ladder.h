// Which camera model a plan needs: the simplest one whose omissions the scene cannot show.
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "base/units.h"
#include "optics/diffraction.h"
#include "optics/plan_request.h"

namespace lensd::optics {

/// The rungs of the ladder, simplest first. Each is a special case of the next.
enum class Rung {
  Pinhole,      ///< no blur at all
  Thin,         ///< geometric blur of the thin lens
  Diffraction,  ///< with the diffraction disk added
  Calibrated,   ///< with the measured figures of this lens: pupil factor, and extension as calibrated
};

/// "pinhole", "thin", "diffraction", "calibrated".
std::string_view RungName(Rung rung);

/// All that may happen while a plan is looked for: any f-number, any extension, any subject of these ranges.
/// f > 0, 0 < N low <= N high, -f < e low <= e high, far <= near (vergences, inside the focal length allowed).
struct LadderRanges {
  Metres focal_length;
  FNumber f_number_low;
  FNumber f_number_high;
  Metres extension_low;
  Metres extension_high;
  Dioptres far;   ///< the least vergence of any subject
  Dioptres near;  ///< the greatest
  /// Without a wavelength diffraction is no part of the question, and no rung is charged for it.
  std::optional<Metres> wavelength = std::nullopt;
  DiffractionConvention convention = DiffractionConvention::Airy;
  double pupil_factor = 1.0;
  /// How far the nominal extension may be from the calibrated one: what only the highest rung knows. >= 0.
  Metres calibration_error{0.0};
};

/// A proven bound on |blur of this rung - blur of the highest rung| over all the ranges. Infinite where a pupil factor
/// above 1 meets subjects so far inside the focal length that its formula ends; 0 for the highest rung.
Metres LeftOut(Rung rung, const LadderRanges& ranges);

/// A rung and the bound on what it leaves out.
struct ChosenModel {
  Rung rung = Rung::Thin;
  Metres error;
};

/// The simplest rung that leaves out at most `tolerance`.
ChosenModel SimplestModel(const LadderRanges& ranges, Metres tolerance);

/// The simplest rung that leaves out no more than the request's model tolerance, whatever plan is chosen; `limits` say
/// at which depths.
ChosenModel ModelFor(const PlanRequest& request, std::span<const LimitAnswer> limits);

/// A tenth of the tightest limit, or a quarter pixel if that is larger; 0 where neither is known, so that nothing that
/// was described is left out.
Metres DefaultModelTolerance(std::optional<Metres> tightest_limit, std::optional<Metres> pixel);

}  // namespace lensd::optics
