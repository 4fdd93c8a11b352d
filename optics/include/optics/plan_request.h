// What the planner is asked and what it answers.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/units.h"
#include "optics/diffraction.h"

namespace lensd::optics {

/// One number of a request. Verdicts refer to decimals, not to the doubles nearest to them: a number is the decimal in
/// `decimal` ("0.8382", "-12e-6") or, where that is empty, the shortest decimal that reads back as `value`, so that 0.1
/// is exactly 1/10. `value` is always the double nearest to it. Converts from a double implicitly.
struct Number {
  double value = 0.0;
  std::string decimal;

  Number(double nearest = 0.0, std::string exact = {})  // NOLINT(google-explicit-constructor)
      : value(nearest), decimal(std::move(exact)) {}
};

/// Where something is along the axis from the lens centre, as it was given: a distance in metres (> 0, infinity
/// allowed) or a vergence in dioptres (finite, 0 is infinity).
struct PlanDepth {
  Number number;
  bool is_vergence = true;

  static PlanDepth Distance(Number metres) { return {std::move(metres), false}; }
  static PlanDepth Vergence(Number dioptres) { return {std::move(dioptres), true}; }
  /// 1/distance or the vergence, rounded.
  Dioptres vergence() const { return {is_vergence ? number.value : 1.0 / number.value}; }
};

/// Every depth between two ends, given in either order; equal ends are one depth.
struct DepthInterval {
  PlanDepth one_end;
  PlanDepth other_end;
};

/// The depths of the plane U = u0 + ux x + uy y over the frame (x and y in [-1, 1]): u0 - |ux| - |uy| to
/// u0 + |ux| + |uy|, added exactly. What lies past infinity (U < 0) shows no subject and is left out, so that the far
/// end is 0 then; OutOfRange when that is all of it.
Result<DepthInterval> DepthsOfPlane(const Number& u0, const Number& ux, const Number& uy);

/// From `low` to `high`, inclusive, low <= high.
struct NumberRange {
  Number low;
  Number high;
};

enum class LimitKind {
  Sharp,    ///< the blur diameter is at most the limit at every depth
  Blurred,  ///< the blur diameter is at least the limit at every depth
};

/// On which side of the focal plane a blurred limit's depths lie: behind is farther from the camera, front is nearer.
/// Either: each of its intervals may lie on any one side, all assignments are tried.
enum class Side { Either, Behind, Front };

/// A limit on blur over one or several depth intervals (several: the occupied depths of a class of a depth map).
struct BlurLimit {
  std::string name;  ///< as it shall appear in answers and conflicts: "sharp[0]", "face"; unique in a request
  LimitKind kind = LimitKind::Sharp;
  std::vector<DepthInterval> depths;
  Number limit;  ///< metres, > 0
  Side side = Side::Either;
};

enum class Objective {
  Light,  ///< smallest f-number; then the smallest worst ratio, then the smallest extension
  Sharp,  ///< smallest worst ratio; then the smallest f-number, then the smallest extension
  Depth,  ///< fixed focus, greatest depth of field at `depth_limit`; then the smallest f-number
};

/// A question to the planner. Lengths are in metres. Limits hold for every extension within `sensor_tolerance` of the
/// answer's and every f-number within the relative `f_number_tolerance`; ranges and focus bind the answer itself.
struct PlanRequest {
  Number focal_length;                   ///< > 0
  NumberRange f_numbers;                 ///< > 0; ignored where there are stops
  std::vector<Number> stops;             ///< the f-numbers that exist, in any order; empty: all of the range
  bool apertures_are_diameters = false;  ///< f_numbers and stops are aperture diameters A, N = f/A
  NumberRange extensions;                ///< low end > -f; below zero is focused past infinity
  /// A lens whose power P changes at a fixed sensor distance Z_s. `focal_length` is Z_s, the focal length at infinity;
  /// f-numbers are Z_s/A; `extensions` and `sensor_tolerance` are Z_s^2 (P - 1/Z_s), the extension that moves the focal
  /// plane as far on a lens so short that its own length does not count (LiquidExtension() converts). The programme is
  /// then the one in (1/A, P). No wavelength, pupil factor 1, no stack: Unsupported.
  bool liquid = false;
  std::optional<PlanDepth> focus;    ///< the focal plane, outside the focal length
  Number sensor_tolerance = 0.0;     ///< >= 0
  Number f_number_tolerance = 0.0;   ///< 0 <= ratio < 1
  std::optional<Number> wavelength;  ///< counts diffraction in sharp limits
  DiffractionConvention diffraction = DiffractionConvention::Airy;
  Number pupil_factor = 1.0;  ///< exit over entrance pupil, > 0
  std::vector<BlurLimit> limits;
  Objective objective = Objective::Light;
  std::optional<Number> depth_limit;      ///< blur that still counts as sharp for Objective::Depth, > 0
  Metres calibration_error{0.0};          ///< for the model ladder: how far the nominal extension may be from the true
  std::optional<Metres> pixel;            ///< for the model ladder
  std::optional<Metres> model_tolerance;  ///< for the model ladder; default a tenth of the tightest limit or a
                                          ///< quarter pixel, whichever is larger
};

/// How one limit fares at the answer, tolerances included. Which one is told by its place: answers come in the order of
/// the request's limits, and keep no copy of 65,536 names.
struct LimitAnswer {
  Dioptres near;
  Dioptres far;
  Metres limit;
  Metres worst;      ///< greatest blur for a sharp limit, least for a blurred one
  Dioptres at;       ///< the vergence where that is
  double ratio = 0;  ///< worst/limit, or limit/worst (at most 1e9) for a blurred limit: holds when at most 1
};

/// One thing that alone prevents a plan.
struct PlanCause {
  std::string cause;   ///< PlanCause of io.lensd.Lens: "fNumber", "sensorTolerance", "focusUncertainty", ...
  std::string reason;  ///< for people, after "possible but for": "the fixed aperture f/1.8: f/4 would do"
};

/// The f-number and extension, or why there are none.
struct PlanAnswer {
  bool feasible = false;

  // Feasible:
  FNumber f_number;
  Metres focal_length;  ///< focused there
  Metres extension;
  Metres aperture_diameter;
  Metres sensor_distance;
  Dioptres focal_plane;
  double magnification = 0;
  FNumber working_f_number;
  double worst_ratio = 0;                       ///< over all limits; 0 without any
  std::vector<LimitAnswer> limits;              ///< one for each of the request's, in their order
  std::optional<DepthInterval> depth_of_field;  ///< Objective::Depth: from near to far
  std::string model;                            ///< "pinhole", "thin", "diffraction", ...
  Metres model_error;                           ///< bound on what that rung leaves out of the blur asked about
  /// The diffraction disk at 550 nm and the working f-number, where the request has no wavelength: what the question
  /// itself leaves out. Nothing for a liquid lens.
  std::optional<Metres> diffraction;

  // Infeasible; where there is a `relax`, all of the above but the model describes the plan that it makes possible,
  // with the limits as they were asked:
  /// Names of limits, "focus", "fNumber", "extension": together infeasible, feasible once any one is dropped (N > 0 and
  /// e >= min(0, low end of the extension range) always stay). For Objective::Depth also "depth".
  std::vector<std::string> conflict;
  /// Smallest factor by which multiplying every sharp limit and dividing every blurred one makes it feasible.
  std::optional<double> relax;
  /// All that alone prevents the plan; Plan() leaves it empty: see optics/plan_causes.h.
  std::vector<PlanCause> causes;

  /// Something the reader should know: for instance that diffraction made the feasible set non-convex and it was
  /// scanned. Empty otherwise.
  std::string note;
};

/// Z_s^2 (P - 1/Z_s) of a liquid lens whose focal length is Z_s - extension, and how far the latter is from the former.
Metres LiquidExtension(Metres sensor_distance, Metres extension);
Metres ExtensionOfLiquid(Metres sensor_distance, Metres liquid_extension);

}  // namespace lensd::optics
