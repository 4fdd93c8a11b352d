// Inequalities in integers, every pair of bounds compared. Clarity before speed.
#include "planner_reference.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace lensd::optics::reference {

namespace {

Rational PowerOfTen(int exponent) {
  const Integer power = boost::multiprecision::pow(Integer(10), static_cast<unsigned>(std::abs(exponent)));
  return exponent < 0 ? Rational(Integer(1), power) : Rational(power);
}

Rational Parse(const std::string& text) {
  const std::size_t e = text.find_first_of("eE");
  std::string digits = text.substr(0, e);
  int exponent = e == std::string::npos ? 0 : std::stoi(text.substr(e + 1));
  if (const std::size_t point = digits.find('.'); point != std::string::npos) {
    exponent -= static_cast<int>(digits.size() - point - 1);
    digits.erase(point, 1);
  }
  const bool negative = digits.starts_with('-');
  if (negative) digits.erase(0, 1);
  digits.erase(0, std::min(digits.find_first_not_of('0'), digits.size() - 1));  // a leading 0 would mean octal
  const Rational value = Rational(Integer(digits)) * PowerOfTen(exponent);
  return negative ? Rational(-value) : value;
}

Rational VergenceOf(const PlanDepth& depth) {
  if (depth.is_vergence) return Exact(depth.number);
  if (std::isinf(depth.number.value)) return 0;
  return 1 / Exact(depth.number);
}

/// n N + e E + c >= 0, in integers.
struct HalfPlane {
  Integer n, e, c;
};

HalfPlane Whole(const Rational& n, const Rational& e, const Rational& c) {
  using boost::multiprecision::denominator;
  using boost::multiprecision::numerator;
  const Integer scale = lcm(lcm(Integer(denominator(n)), Integer(denominator(e))), Integer(denominator(c)));
  return {numerator(Rational(n * scale)), numerator(Rational(e * scale)), numerator(Rational(c * scale))};
}

struct Lens {
  Rational f, delta, epsilon, pupil;
};

Lens LensOf(const PlanRequest& request) {
  return {Exact(request.focal_length), Exact(request.sensor_tolerance), Exact(request.f_number_tolerance),
          Exact(request.pupil_factor)};
}

/// N times the signed blur at extension e + shift is slope e + constant.
struct Blur {
  Rational slope, constant;
};

Blur SignedBlur(const Lens& lens, const Rational& vergence, const Rational& shift) {
  // s = (f/N) ((f + e)(1/f - U) - 1) / (1 + f U (1/p - 1))
  const Rational w = 1 / lens.f - vergence;
  const Rational divisor = 1 + lens.f * vergence * (1 / lens.pupil - 1);
  return {lens.f * w / divisor, lens.f * ((lens.f + shift) * w - 1) / divisor};
}

enum class As { Sharp, Behind, Front };

void AddLimit(const Lens& lens, const DepthInterval& interval, As as, const Rational& limit, const Rational& ratio,
              std::vector<HalfPlane>& planes) {
  for (const PlanDepth* end : {&interval.one_end, &interval.other_end}) {
    for (const int way : {-1, 1}) {
      const Blur blur = SignedBlur(lens, VergenceOf(*end), way * lens.delta);
      if (as == As::Sharp) {
        const Rational reach = limit * (1 - lens.epsilon) * ratio;
        planes.push_back(Whole(reach, -blur.slope, -blur.constant));
        planes.push_back(Whole(reach, blur.slope, blur.constant));
      } else {
        const Rational reach = limit * (1 + lens.epsilon) / ratio;
        const int sign = as == As::Behind ? 1 : -1;
        planes.push_back(Whole(-reach, sign * blur.slope, sign * blur.constant));
      }
      if (lens.delta == 0) break;
    }
  }
}

/// Bounds on N as they are collected; fractions.
struct Bounds {
  std::optional<Rational> low, high;
  bool empty = false;

  void Add(const Integer& n, const Integer& c) {  // n N + c >= 0
    if (n == 0) {
      empty = empty || c < 0;
    } else if (n > 0) {
      if (low && c * denominator(*low) + n * numerator(*low) >= 0) return;
      low = Rational(Integer(-c), n);
    } else {
      if (high && c * denominator(*high) + n * numerator(*high) >= 0) return;
      high = Rational(c, Integer(-n));
    }
  }
};

std::optional<NRange> Eliminate(const std::vector<HalfPlane>& planes) {
  Bounds bounds;
  std::vector<const HalfPlane*> upper, lower;
  for (const HalfPlane& plane : planes) {
    if (plane.e == 0) bounds.Add(plane.n, plane.c);
    if (plane.e < 0) upper.push_back(&plane);
    if (plane.e > 0) lower.push_back(&plane);
  }
  for (const HalfPlane* u : upper) {
    for (const HalfPlane* l : lower) {
      bounds.Add(Integer(u->n * l->e - l->n * u->e), Integer(u->c * l->e - l->c * u->e));
      if (bounds.empty) return std::nullopt;
    }
  }
  if (bounds.empty || (bounds.high && *bounds.high <= 0)) return std::nullopt;
  if (bounds.low && bounds.high && *bounds.low > *bounds.high) return std::nullopt;
  const Rational low = bounds.low && *bounds.low > 0 ? *bounds.low : Rational(0);
  return NRange{low, bounds.high ? *bounds.high : Rational(-1)};
}

struct Open {
  const DepthInterval* interval;
  Rational limit;
};

}  // namespace

Rational Exact(const Number& number) {
  if (!number.decimal.empty()) return Parse(number.decimal);
  char text[64];
  const auto end = std::to_chars(text, text + sizeof text, number.value);
  return Parse(std::string(text, end.ptr));
}

Rational FromDouble(double value) {
  int exponent = 0;
  const double mantissa = std::frexp(value, &exponent);
  const Integer whole = static_cast<long long>(std::ldexp(mantissa, 53));
  exponent -= 53;
  const Integer scale = Integer(1) << static_cast<unsigned>(std::abs(exponent));
  return exponent < 0 ? Rational(whole, scale) : Rational(Integer(whole * scale));
}

std::string DecimalText(const Rational& rational) {
  Integer rest = denominator(rational);
  int twos = 0, fives = 0;
  for (; rest % 2 == 0; ++twos) rest /= 2;
  for (; rest % 5 == 0; ++fives) rest /= 5;
  if (rest != 1) return {};
  const int digits = std::max(twos, fives);
  return Integer(numerator(Rational(rational * PowerOfTen(digits)))).str() + "e" + std::to_string(-digits);
}

Number ExactNumber(const Rational& rational) {
  const std::string text = DecimalText(rational);
  return {std::strtod(text.c_str(), nullptr), text};
}

std::optional<NRange> Feasible(const PlanRequest& request, const Question& question) {
  const auto binds = [&](const std::string& name) { return !question.names || question.names->contains(name); };
  const Lens lens = LensOf(request);
  std::vector<HalfPlane> given;
  std::vector<Open> open;
  for (const BlurLimit& limit : request.limits) {
    if (!binds(limit.name)) continue;
    const Rational size = Exact(limit.limit);
    for (const DepthInterval& interval : limit.depths) {
      if (limit.kind == LimitKind::Sharp) {
        AddLimit(lens, interval, As::Sharp, size, question.ratio, given);
      } else if (limit.side == Side::Either) {
        open.push_back({&interval, size});
      } else {
        AddLimit(lens, interval, limit.side == Side::Behind ? As::Behind : As::Front, size, question.ratio, given);
      }
    }
  }
  if (request.objective == Objective::Depth && binds("depth")) {
    AddLimit(lens, {*request.focus, *request.focus}, As::Sharp, Exact(*request.depth_limit), question.ratio, given);
  }
  const Rational low = Exact(request.extensions.low);
  given.push_back(Whole(0, 1, low < 0 ? Rational(-low) : Rational(0)));
  if (binds("extension")) {
    given.push_back(Whole(0, 1, -low));
    given.push_back(Whole(0, -1, Exact(request.extensions.high)));
  }
  if (request.focus && binds("focus")) {
    const Rational u = VergenceOf(*request.focus);
    const Rational e = 1 / (1 / lens.f - u) - lens.f;
    given.push_back(Whole(0, 1, -e));
    given.push_back(Whole(0, -1, e));
  }
  std::vector<std::pair<Rational, Rational>> f_numbers;  // ranges of N
  const auto to_n = [&](const Number& number) {
    return request.apertures_are_diameters ? Rational(lens.f / Exact(number)) : Exact(number);
  };
  if (question.n) {
    f_numbers.emplace_back(*question.n, *question.n);
  } else if (!binds("fNumber")) {
    f_numbers.emplace_back(0, -1);
  } else if (!request.stops.empty()) {
    for (const Number& stop : request.stops) f_numbers.emplace_back(to_n(stop), to_n(stop));
  } else {
    f_numbers.emplace_back(to_n(request.f_numbers.low), to_n(request.f_numbers.high));
    if (request.apertures_are_diameters) std::swap(f_numbers[0].first, f_numbers[0].second);
  }
  std::optional<NRange> all;
  for (unsigned sides = 0; sides < (1u << open.size()); ++sides) {
    std::vector<HalfPlane> planes = given;
    for (std::size_t i = 0; i < open.size(); ++i) {
      AddLimit(lens, *open[i].interval, (sides >> i & 1) != 0 ? As::Behind : As::Front, open[i].limit, question.ratio,
               planes);
    }
    const std::optional<NRange> polygon = Eliminate(planes);
    if (!polygon) continue;
    for (const auto& [from, to] : f_numbers) {
      std::optional<NRange> range = NRange{std::max(polygon->smallest, from), polygon->largest};
      if (to >= 0 && (range->largest < 0 || to < range->largest)) range->largest = to;
      if (range->largest >= 0 && range->smallest > range->largest) continue;
      if (!all) {
        all = range;
      } else {
        all->smallest = std::min(all->smallest, range->smallest);
        if (all->largest >= 0)
          all->largest = range->largest < 0 ? range->largest : std::max(all->largest, range->largest);
      }
    }
  }
  return all;
}

Rational Excess(const PlanRequest& request, const BlurLimit& limit, double n, double e) {
  const Lens lens = LensOf(request);
  const Rational size = Exact(limit.limit), f_number = FromDouble(n), extension = FromDouble(e);
  std::optional<Rational> worst;
  const auto raise = [&](const Rational& excess) {
    if (!worst || excess > *worst) worst = excess;
  };
  for (const DepthInterval& interval : limit.depths) {
    std::optional<Rational> behind, front;
    for (const PlanDepth* end : {&interval.one_end, &interval.other_end}) {
      for (const int way : {-1, 1}) {
        const Blur blur = SignedBlur(lens, VergenceOf(*end), way * lens.delta);
        const Rational s = (blur.slope * extension + blur.constant) / f_number;
        if (limit.kind == LimitKind::Sharp) {
          raise(Rational(abs(s) / (1 - lens.epsilon) / size - 1));
          continue;
        }
        const Rational lacking_behind = 1 - s / (1 + lens.epsilon) / size;
        const Rational lacking_front = 1 + s / (1 + lens.epsilon) / size;
        if (!behind || lacking_behind > *behind) behind = lacking_behind;
        if (!front || lacking_front > *front) front = lacking_front;
      }
    }
    if (limit.kind == LimitKind::Sharp) continue;
    raise(limit.side == Side::Behind ? *behind : limit.side == Side::Front ? *front : std::min(*behind, *front));
  }
  return *worst;
}

}  // namespace lensd::optics::reference
