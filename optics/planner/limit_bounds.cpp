// The planner's own lines and curves at one f-number, in double precision.
#include "optics/limit_bounds.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "optics/blur.h"
#include "optics/light.h"
#include "optics/planner/diffraction_curves.h"

namespace lensd::optics {

namespace {

double Double(const Number& number) {
  return number.value;
}

ObjectDepth ToObjectDepth(const PlanDepth& depth) {
  if (depth.is_vergence) return Dioptres{depth.number.value};
  return Metres{depth.number.value};
}

/// N times the signed blur, above 0 behind the focal plane.
double BlurTimesN(const PlanRequest& request, const PlanDepth& depth, double e) {
  const Metres f{request.focal_length.value};
  if (request.liquid) return e - f.value * f.value * depth.vergence().value;
  const ObjectDepth object = ToObjectDepth(depth);
  return SignedBlur(ThinLens{f, {1.0}, {e}}, object).value / PupilDivisor(f, object, request.pupil_factor.value);
}

Metres DiffractionAt(const PlanRequest& request, double n, double e) {
  const Metres f{request.focal_length.value};
  const FNumber working = WorkingFNumber({n}, Magnification(f, {e}), request.pupil_factor.value);
  return DiffractionBlur(request.diffraction, {request.wavelength->value}, working);
}

/// The greatest total blur over the tolerances: blur squared is convex in e and in N², so it is at a corner.
double MostBlur(const PlanRequest& request, const PlanDepth& depth, double n, double e) {
  const double delta = request.sensor_tolerance.value, epsilon = request.f_number_tolerance.value;
  double most = 0.0;
  for (const double at : {e - delta, e + delta}) {
    const Metres blur{std::abs(BlurTimesN(request, depth, at)) / n};
    most = std::max(most, blur.value / (1.0 - epsilon));
    if (!request.wavelength) continue;
    const Metres disk = DiffractionAt(request, n, at);
    for (const double stretch : {1.0 - epsilon, 1.0 + epsilon}) {
      most = std::max(most, TotalBlur(blur / stretch, disk * stretch).value);
    }
  }
  return most;
}

/// The least geometric blur over the tolerances.
double LeastBlur(const PlanRequest& request, Side side, const PlanDepth& depth, double n, double e) {
  const double delta = request.sensor_tolerance.value;
  const double one = BlurTimesN(request, depth, e - delta), other = BlurTimesN(request, depth, e + delta);
  const double behind = std::min(one, other), front = std::min(-one, -other);
  const double least = side == Side::Behind ? behind : side == Side::Front ? front : std::max(behind, front);
  return std::max(least, 0.0) / (n * (1.0 + request.f_number_tolerance.value));
}

/// Takes one row's bounds at N.
class Narrowed {
 public:
  Narrowed(const PlanRequest& request, double n) : request_(request), n_(n), lens_(LensOf<double>(request, Double)) {}

  void Take(RowKind kind, const PlanDepth& depth, double limit) {
    const DepthNumbers<double> numbers = NumbersOf(depth, lens_, Double);
    const LimitLine<double> line = LineOf(kind, numbers, lens_, limit);
    const double edge = line.p + line.q * n_;
    if (line.bounds == Bounds::Above) Lower(edge);
    if (line.bounds == Bounds::Below) Raise(edge);
    if (line.bounds == Bounds::Nothing || (line.bounds == Bounds::FNumber && n_ > line.p)) Empty();
    if (!request_.wavelength || (kind != RowKind::SharpFar && kind != RowKind::SharpNear)) return;
    const double k = DiffractionFactor(request_.diffraction) * request_.wavelength->value / lens_.f;
    for (const SharpCurve<double>& curve : CurvesOf(numbers, lens_, limit, 0)) {
      const auto interval = IntervalOf(curve, lens_, k, n_, 1.0);
      if (!interval) return Empty();
      Lower(interval->high - lens_.delta);
      Raise(interval->low + lens_.delta);
    }
  }
  HoldingExtensions holding() const { return holding_; }

 private:
  void Lower(double edge) { holding_.high.value = std::min(holding_.high.value, edge); }
  void Raise(double edge) { holding_.low.value = std::max(holding_.low.value, edge); }
  void Empty() {
    constexpr double kNone = std::numeric_limits<double>::infinity();
    holding_ = {{kNone}, {-kNone}};
  }

  const PlanRequest& request_;
  double n_;
  LensNumbers<double> lens_;
  HoldingExtensions holding_;
};

}  // namespace

Metres TotalBlurAt(const PlanRequest& request, const PlanDepth& depth, FNumber f_number, Metres extension) {
  const Metres blur{std::abs(BlurTimesN(request, depth, extension.value)) / f_number.value};
  return request.wavelength ? TotalBlur(blur, DiffractionAt(request, f_number.value, extension.value)) : blur;
}

WorstBlurs::WorstBlurs(const PlanRequest& request, FNumber f_number, Metres extension)
    : request_(request),
      f_(request.focal_length.value),
      n_(f_number.value),
      e_(extension.value),
      delta_(request.sensor_tolerance.value),
      plain_(!request.wavelength && !request.liquid && request.pupil_factor.value == 1.0) {
  const double epsilon = request.f_number_tolerance.value, most = n_ * (1.0 + epsilon);
  kinds_ = {{{1.0, -1.0, 1.0, n_ * (1.0 - epsilon)}, {-1.0, -1.0, -1.0, most}, {1.0, 1.0, -1.0, most}}};
}

// Plain doubles, where rounding them is a small part of the limit, for one interval whose ends are of one kind. Limits
// of all kinds come in any order, which no processor guesses: what they differ in are factors.
WorstBlur WorstBlurs::Of(const BlurLimit& limit) const {
  if (!plain_ || limit.depths.size() != 1 || IsOpen(limit)) return Precisely(limit);
  const auto& [one, other] = limit.depths.front();
  const Kind& kind = kinds_[KindIndex(limit)];
  constexpr double kPart = 5e-13, kUlps = 2.0 * std::numeric_limits<double>::epsilon();
  const double reach = kPart / kUlps * kind.n * limit.limit.value;
  const auto judged = [&](const PlanDepth& depth, bool& good) {
    const double value = depth.number.value;
    const double scale = depth.is_vergence ? 1.0 : value, u = depth.is_vergence ? value : 1.0;
    const double w = scale - f_ * u, v = f_ * f_ * u, moved = w * e_;
    good = std::abs(moved) + v < reach * scale;
    double blur = moved - v, spread = std::abs(w) * delta_;
    if (!depth.is_vergence) blur /= scale, spread /= scale;
    return std::max(kind.behind * blur, kind.front * blur) + spread;
  };
  bool good = false, other_good = false;
  const double at_one = judged(one, good), at_other = judged(other, other_good);
  if (!good || !other_good) return Precisely(limit);
  const std::array<const PlanDepth*, 2> ends{&one, &other};
  return {{std::max(kind.sign * std::max(at_one, at_other), 0.0) / kind.n}, ends[at_other > at_one ? 1 : 0]};
}

WorstBlur WorstBlurs::Precisely(const BlurLimit& limit) const {
  WorstBlur worst;
  for (const DepthInterval& interval : limit.depths) {
    for (const PlanDepth* depth : {&interval.one_end, &interval.other_end}) {
      const bool sharp = limit.kind == LimitKind::Sharp;
      const double blur = sharp ? MostBlur(request_, *depth, n_, e_) : LeastBlur(request_, limit.side, *depth, n_, e_);
      if (worst.at != nullptr && (sharp ? blur <= worst.blur.value : blur >= worst.blur.value)) continue;
      worst = {{blur}, depth};
    }
  }
  return worst;
}

HoldingExtensions WhereHolds(const PlanRequest& request, const BlurLimit& limit, FNumber f_number,
                             Dioptres focal_plane) {
  Narrowed narrowed(request, f_number.value);
  for (const DepthInterval& interval : limit.depths) {
    const Dioptres middle = 0.5 * (interval.one_end.vergence() + interval.other_end.vergence());
    const bool behind = limit.side == Side::Either ? middle < focal_plane : limit.side == Side::Behind;
    for (const PlanDepth* depth : {&interval.one_end, &interval.other_end}) {
      if (limit.kind == LimitKind::Blurred) {
        narrowed.Take(behind ? RowKind::Behind : RowKind::Front, *depth, limit.limit.value);
        continue;
      }
      narrowed.Take(RowKind::SharpFar, *depth, limit.limit.value);
      narrowed.Take(RowKind::SharpNear, *depth, limit.limit.value);
    }
  }
  return narrowed.holding();
}

}  // namespace lensd::optics
