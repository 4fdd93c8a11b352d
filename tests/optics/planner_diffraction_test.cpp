// The planner with diffraction against 60-digit arithmetic: at each f-number the extensions a limit leaves, straight
// from the optics; over the f-number by ternary search of the concave width.
#include <gtest/gtest.h>

#include <boost/multiprecision/cpp_dec_float.hpp>
#include <cmath>
#include <random>

#include "planner_adversary.h"
#include "planner_reference.h"
#include "test_level.h"

namespace lensd::optics::reference {
namespace {

using Real = boost::multiprecision::number<boost::multiprecision::cpp_dec_float<60>, boost::multiprecision::et_off>;

Real ToReal(const Number& number) {
  const Rational exact = Exact(number);
  return Real(numerator(exact)) / Real(denominator(exact));
}

Real VergenceOf(const PlanDepth& depth) {
  if (depth.is_vergence) return ToReal(depth.number);
  return std::isinf(depth.number.value) ? Real(0) : Real(1 / ToReal(depth.number));
}

struct Optics {
  explicit Optics(const PlanRequest& request)
      : f(ToReal(request.focal_length)),
        delta(ToReal(request.sensor_tolerance)),
        epsilon(ToReal(request.f_number_tolerance)),
        lambda(ToReal(*request.wavelength) * (request.diffraction == DiffractionConvention::Airy ? 244 : 175) / 100) {}

  /// Diameter of the blur of a sharp limit, or of geometric blur, at extension e.
  Real Signed(const Real& u, const Real& n, const Real& e) const { return f / n * ((f + e) * (1 / f - u) - 1); }
  Real Total(const Real& u, const Real& n, const Real& e) const {
    const Real b = Signed(u, n, e), d = lambda * (f + e) * n / f;
    return sqrt(b * b + d * d);
  }

  Real f, delta, epsilon, lambda;
};

/// What is left of e at one f-number: high - low, or nothing where diffraction alone breaks a limit.
std::optional<Real> Width(const PlanRequest& request, const Optics& o, const Real& n, const Real& ratio = 1) {
  Real low = ToReal(request.extensions.low), high = ToReal(request.extensions.high);
  for (const BlurLimit& limit : request.limits) {
    const Real size = ToReal(limit.limit);
    for (const DepthInterval& interval : limit.depths) {
      for (const PlanDepth* end : {&interval.one_end, &interval.other_end}) {
        const Real u = VergenceOf(*end), w = 1 / o.f - u;
        if (limit.kind == LimitKind::Sharp) {
          // (f/N)² (Z w - 1)² + (k Z N)² <= c², k = λ'/f, a quadratic in Z
          const Real c = size * (1 - o.epsilon) * ratio, k = o.lambda / o.f * n, g = o.f / n;
          const Real a = g * g * w * w + k * k, b = g * g * w, rest = g * g - c * c;
          const Real root = b * b - a * rest;
          if (root < 0) return std::nullopt;
          low = std::max(low, Real((b - sqrt(root)) / a - o.f + o.delta));
          high = std::min(high, Real((b + sqrt(root)) / a - o.f - o.delta));
        } else {
          const Real reach = size * (1 + o.epsilon) / ratio * n / o.f;  // (f + e) w - 1 = ± reach
          const int side = limit.side == Side::Behind ? 1 : -1;
          const Real edge = (1 + side * reach) / w - o.f;
          if (side > 0) low = std::max(low, Real(edge + o.delta));
          if (side < 0) high = std::min(high, Real(edge - o.delta));
        }
      }
    }
  }
  return high - low;
}

/// Exact ties come out of 60 digits with an error this small.
const Real kTie("1e-50");

/// Whether some f-number of the range leaves something, by ternary search of the concave width.
bool Feasible60(const PlanRequest& request, const Optics& o, const Real& ratio = 1) {
  Real a = ToReal(request.f_numbers.low), b = ToReal(request.f_numbers.high);
  for (int i = 0; i < 220; ++i) {
    const Real left = a + (b - a) / 3, right = b - (b - a) / 3;
    const auto at_a = Width(request, o, a, ratio), at_left = Width(request, o, left, ratio),
               at_right = Width(request, o, right, ratio);
    if ((at_a && *at_a >= -kTie) || (at_left && *at_left >= -kTie) || (at_right && *at_right >= -kTie)) return true;
    if (!at_left) {
      b = left;
    } else if (!at_right || *at_left > *at_right) {
      b = right;
    } else {
      a = left;
    }
  }
  return false;
}

/// Whether the width is concave with limits times `ratio`, so that ternary search is sound.
bool IsConvex(const PlanRequest& request, double ratio) {
  return std::all_of(request.limits.begin(), request.limits.end(), [&](const BlurLimit& limit) {
    return ratio * limit.limit.value * request.f_numbers.high.value < 0.35 * request.focal_length.value;
  });
}

/// An adversarial request with sides given and a thin lens, the wavelength drawn so that diffraction matters.
PlanRequest Request(std::uint64_t seed) {
  PlanRequest request = AdversarialRequest(seed);
  std::mt19937_64 random(seed);
  request.wavelength = std::array{Number(550e-9), Number(400e-9), Number(10e-6)}[random() % 3];
  request.diffraction = random() % 2 == 0 ? DiffractionConvention::Airy : DiffractionConvention::Mtf50;
  request.pupil_factor = 1.0;
  request.stops.clear();
  request.focus.reset();
  request.objective = random() % 3 == 0 ? Objective::Sharp : Objective::Light;
  std::erase_if(request.limits, [&](BlurLimit& limit) {
    if (limit.side == Side::Either) limit.side = random() % 2 == 0 ? Side::Behind : Side::Front;
    bool inside = limit.limit.value * request.f_numbers.high.value > 0.3 * request.focal_length.value;  // not convex
    for (const DepthInterval& interval : limit.depths) {
      for (const PlanDepth* end : {&interval.one_end, &interval.other_end}) {
        inside = inside || !(end->vergence().value * request.focal_length.value < 0.999999);
      }
    }
    return inside;
  });
  return request;
}

void CheckLimits(const PlanRequest& request, const Optics& o, const PlanAnswer& answer) {
  const Real n = answer.f_number.value, e = answer.extension.value;
  const double ulp = std::nextafter(std::abs(answer.extension.value), 1.0) - std::abs(answer.extension.value);
  for (const BlurLimit& limit : request.limits) {
    const Real size = ToReal(limit.limit);
    const Real allowed = std::max(1e-12, 2.0 * ulp / (limit.limit.value * answer.f_number.value));
    for (const DepthInterval& interval : limit.depths) {
      for (const PlanDepth* end : {&interval.one_end, &interval.other_end}) {
        for (const Real& at : {Real(e - o.delta), Real(e + o.delta)}) {
          const Real u = VergenceOf(*end);
          if (limit.kind == LimitKind::Sharp) {
            EXPECT_LE(o.Total(u, n, at) / (1 - o.epsilon) / size, 1 + allowed) << limit.name;
          } else {
            const Real s = o.Signed(u, n, at) * (limit.side == Side::Behind ? 1 : -1);
            EXPECT_GE(s / (1 + o.epsilon) / size, 1 - allowed) << limit.name;
          }
        }
      }
    }
  }
}

void CheckBest(const PlanRequest& request, const Optics& o, const PlanAnswer& answer) {
  if (request.objective == Objective::Sharp) {
    if (answer.worst_ratio > 1e-9 && IsConvex(request, 1.0)) {
      EXPECT_FALSE(Feasible60(request, o, Real(answer.worst_ratio) * (1 - Real(1e-9))));
    }
  } else if (answer.f_number.value > request.f_numbers.low.value) {
    const auto less = Width(request, o, Real(answer.f_number.value) * (1 - Real(1e-12)));
    EXPECT_TRUE(!less || *less < 0) << "a smaller f-number would do";
  }
}

TEST(PlannerDiffraction, AgreesWithSixtyDigits) {
  const long count = testing::ByLevel(60, 600, 100000);
  long feasible = 0, infeasible = 0, diffracted = 0;
  for (long seed = 0; seed < count; ++seed) {
    const PlanRequest request = Request(static_cast<std::uint64_t>(seed));
    SCOPED_TRACE(::testing::Message() << "seed " << seed << " wavelength " << request.wavelength->value << "\n"
                                      << Show(request));
    const Result<PlanAnswer> answer = Plan(request);
    ASSERT_TRUE(answer.has_value()) << answer.error().message;
    const Optics o(request);
    ASSERT_EQ(answer->feasible, Feasible60(request, o));
    PlanRequest geometric = request;
    geometric.wavelength.reset();
    if (answer->feasible) {
      ++feasible;
      CheckLimits(request, o, *answer);
      CheckBest(request, o, *answer);
    } else {
      ++infeasible;
      diffracted += Plan(geometric)->feasible ? 1 : 0;
      if (answer->relax && IsConvex(request, *answer->relax)) {
        EXPECT_TRUE(Feasible60(request, o, Real(*answer->relax) * (1 + Real(1e-9))));
        EXPECT_FALSE(Feasible60(request, o, Real(*answer->relax) * (1 - Real(1e-9))));
      }
    }
    if (HasFailure()) break;
  }
  if (!HasFailure()) {
    EXPECT_GT(feasible, count / 8);
    EXPECT_GT(infeasible, count / 8);
    EXPECT_GT(diffracted, count / 100);  // infeasible by diffraction alone
  }
}

}  // namespace
}  // namespace lensd::optics::reference
