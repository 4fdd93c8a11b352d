// The planner's problem with diffraction in eighty digits: at each f-number the extensions that a limit leaves,
// straight from the optics. Shares nothing with the planner it checks but the request type.
#pragma once

#include <boost/multiprecision/cpp_dec_float.hpp>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "optics/planner.h"

namespace lensd::optics::reference {

using Real = boost::multiprecision::number<boost::multiprecision::cpp_dec_float<80>, boost::multiprecision::et_off>;

Real ToReal(const Number& number);
Real Vergence80(const PlanDepth& depth);

/// The names that bind: limits, "focus", "fNumber", "extension".
using Names = std::set<std::string>;

Names AllNames(const PlanRequest& request);

struct Optics {
  explicit Optics(const PlanRequest& request)
      : f(ToReal(request.focal_length)),
        pupil(ToReal(request.pupil_factor)),
        delta(ToReal(request.sensor_tolerance)),
        epsilon(ToReal(request.f_number_tolerance)),
        lambda(ToReal(*request.wavelength) * (request.diffraction == DiffractionConvention::Airy ? 244 : 175) / 100) {}

  Real Skew(const Real& u) const { return 1 + f * u * (1 / pupil - 1); }
  /// Geometric blur at extension e, above 0 behind the focal plane, and with the Airy disk at the working f-number.
  Real Signed(const Real& u, const Real& n, const Real& e) const {
    return f / n * ((f + e) * (1 / f - u) - 1) / Skew(u);
  }
  Real Total(const Real& u, const Real& n, const Real& e) const {
    const Real b = Signed(u, n, e), d = lambda * n * (1 + e / (f * pupil));
    return sqrt(b * b + d * d);
  }

  Real f, pupil, delta, epsilon, lambda;
};

/// One depth under one limit, its side decided.
struct Wall {
  enum class Kind { Sharp, Behind, Front } kind = Kind::Sharp;
  Real u, size;
};

/// One choice of sides for the names in force: walls and a box.
struct LinearProgram {
  std::vector<Wall> walls;
  Real low, high;  ///< of the extension
};

/// What is left of e at one f-number.
struct Left {
  Real low, high;
  Real width() const { return high - low; }
};

/// Nothing where diffraction alone breaks a limit. Digits must not cancel, however small N is: what faces each other
/// may differ by N times the twentieth digit of a limit.
std::optional<Left> LeftAt(const LinearProgram& programme, const Optics& o, const Real& n, const Real& ratio);
/// Whether that is anything.
bool Leaves(const std::optional<Left>& left);

/// Calls `visit` for each choice of sides; what the box and a fixed plane leave empty is passed over.
void ForEachProgramme(const PlanRequest& request, const Optics& o, const Names& names,
                      const std::function<void(const LinearProgram&)>& visit);

/// Whether some setting meets everything in force, sharp limits times `ratio` and blurred ones over it. Nothing where
/// this reference cannot say: the width would have to be concave beyond where it is known to be.
std::optional<bool> FeasibleExactly(const PlanRequest& request, const Names& names, const Real& ratio = 1);

}  // namespace lensd::optics::reference
