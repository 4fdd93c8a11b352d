// Every number is a short decimal, held as a rational: limits are computed from a chosen setting, so that it meets them
// with nothing to spare.
#include "planner_adversary.h"

#include <algorithm>
#include <random>
#include <sstream>
#include <string>

#include "planner_reference.h"

namespace lensd::optics::reference {

namespace {

/// A decimal of few digits: mantissa * 10^exponent.
Rational Decimal(long long mantissa, int exponent) {
  Rational value = mantissa;
  for (int i = 0; i < std::abs(exponent); ++i) value = exponent < 0 ? Rational(value / 10) : Rational(value * 10);
  return value;
}

class Adversary {
 public:
  explicit Adversary(std::uint64_t seed) : random_(seed * 0x9E3779B97F4A7C15ull + 12345) {}

  PlanRequest Make() {
    Lens();
    Hardware();
    Tolerances();
    Focus();
    const int count = Pick({0, 1, 1, 2, 2, 2, 3, 3, 4, 5});
    for (int i = 0; i < count; ++i) Limit(i);
    request_.objective = Pick({Objective::Light, Objective::Light, Objective::Light, Objective::Sharp});
    if (request_.focus && Chance(4)) {
      request_.objective = Objective::Depth;
      request_.depth_limit = ExactNumber(Decimal(Int(2, 60), -6));
    }
    return request_;
  }

 private:
  long long Int(long long low, long long high) { return std::uniform_int_distribution<long long>(low, high)(random_); }
  bool Chance(int one_in) { return Int(1, one_in) == 1; }
  template <class T>
  T Pick(std::initializer_list<T> choices) {
    return *(choices.begin() + Int(0, static_cast<long long>(choices.size()) - 1));
  }

  void Lens() {
    f_ = Decimal(Pick({50, 25, 8, 100, 35, 16, 200, 85}), -3);
    pupil_ = Chance(6) ? Decimal(Pick({5, 8, 16, 20}), -1) : Rational(1);
    request_.focal_length = ExactNumber(f_);
    request_.pupil_factor = ExactNumber(pupil_);
    // The place most limits are drawn through: finite decimals, so that ties are exact.
    n0_ = Decimal(Pick({16, 20, 25, 32, 40, 50, 64, 80, 100, 125, 160}), -1);
    e0_ = Chance(8) ? Rational(0) : Chance(8) ? f_ : Rational(f_ * Decimal(Int(1, 400), -4));
    if (Chance(12)) e0_ = -f_ * Decimal(Int(1, 100), -4);
  }

  void Hardware() {
    Rational n_low = Decimal(Int(10, 30), -1), n_high = Decimal(Int(8, 32), 0);
    if (Chance(4)) n_low = n0_;
    if (Chance(5)) n_high = std::max(n0_, n_low);
    if (Chance(12)) n_high = n_low;
    if (n_low > n_high) std::swap(n_low, n_high);
    request_.f_numbers = {ExactNumber(n_low), ExactNumber(n_high)};
    if (Chance(5)) {
      for (const int stop : {14, 20, 28, 40, 56, 80, 110, 160}) {
        if (Chance(2)) request_.stops.push_back(ExactNumber(Decimal(stop, -1)));
      }
      if (Chance(2)) request_.stops.push_back(ExactNumber(n0_));
      std::shuffle(request_.stops.begin(), request_.stops.end(), random_);
    }
    Rational low = e0_ < 0 || Chance(8) ? Rational(-f_ * Decimal(Int(0, 200), -4)) : Rational(0);
    Rational high = Rational(f_ * Decimal(Int(1, 600), -4));
    if (Chance(5)) low = e0_;
    if (Chance(5)) high = e0_;
    if (Chance(15)) low = high = e0_;
    if (low > high) std::swap(low, high);
    request_.extensions = {ExactNumber(low), ExactNumber(high)};
  }

  void Tolerances() {
    delta_ = Chance(2) ? Rational(0) : Decimal(Int(1, 50), -6);
    epsilon_ = Chance(2) ? Rational(0) : Pick({Decimal(2, -2), Decimal(5, -2), Decimal(20, -2)});
    request_.sensor_tolerance = ExactNumber(delta_);
    request_.f_number_tolerance = ExactNumber(epsilon_);
  }

  void Focus() {
    if (!Chance(4)) return;
    if (Chance(3)) {
      request_.focus = PlanDepth::Distance(ExactNumber(Rational(f_ + Decimal(Int(1, 5000), Pick({-3, -3, -2, -9})))));
    } else {
      request_.focus = PlanDepth::Vergence(ExactNumber(Decimal(Int(Chance(10) ? -50 : 0, 300), -2)));
    }
  }

  /// A vergence of few digits within the closest focus.
  Rational Vergence() {
    if (Chance(6)) return 0;
    if (subject_ && Chance(4)) return Rational(*subject_ + Decimal(Int(0, 9), Pick({-3, -6, -12, -15})));
    const Rational u = Decimal(Int(1, 999), Pick({-3, -2, -2, -2}));
    subject_ = u * f_ < 1 ? u : Decimal(1, -1);
    return *subject_;
  }

  PlanDepth Depth(const Rational& u) {
    if (u == 0 && Chance(2)) return PlanDepth::Distance(std::numeric_limits<double>::infinity());
    return PlanDepth::Vergence(ExactNumber(u));
  }

  /// |signed blur| at the chosen place, tolerances included, so that the limit touches it exactly; nothing if zero.
  std::optional<Rational> Touching(const Rational& u, const Rational& shift, bool sharp) {
    const Rational g = 1 + f_ * u * (1 / pupil_ - 1);
    const Rational s = ((1 - f_ * u) * (e0_ + shift) - f_ * f_ * u) / (n0_ * g);
    Rational size = abs(s) / (sharp ? Rational(1 - epsilon_) : Rational(1 + epsilon_));
    if (size == 0 || DecimalText(size).empty()) return std::nullopt;
    return size;
  }

  void Limit(int index) {
    BlurLimit limit;
    const bool sharp = Chance(2);
    limit.kind = sharp ? LimitKind::Sharp : LimitKind::Blurred;
    limit.name = (sharp ? "sharp[" : "blurred[") + std::to_string(index) + "]";
    limit.side = Pick({Side::Either, Side::Behind, Side::Front});
    const int intervals = Chance(8) ? 2 : 1;
    Rational u;
    for (int i = 0; i < intervals; ++i) {
      u = Vergence();
      if (Chance(4)) {  // as a distance
        const Rational z = f_ + Decimal(Int(1, 9000), Pick({-3, -3, -2, -12}));
        limit.depths.push_back(
            {PlanDepth::Distance(ExactNumber(z)), Chance(2) ? PlanDepth::Distance(ExactNumber(z)) : Depth(0)});
      } else if (Chance(3)) {
        limit.depths.push_back({Depth(u), Depth(u)});
      } else {
        Rational other = Vergence();
        if (!sharp && Chance(10)) other = Rational(1 / f_ + Pick({Rational(0), Rational(1), Rational(20)}));
        if (DecimalText(other).empty() || (1 + f_ * other * (1 / pupil_ - 1)) <= 0) other = u;
        limit.depths.push_back({Depth(u), Depth(other)});
      }
    }
    std::optional<Rational> size;
    if (Chance(2)) size = Touching(u, (Chance(2) ? 1 : -1) * delta_, sharp);
    if (size && Chance(4)) *size += Pick({Decimal(1, -22), Decimal(-1, -22), Decimal(1, -16), Decimal(-1, -19)});
    if (!size || *size <= 0) size = Decimal(Int(1, 400), Pick({-6, -6, -7, -5}));
    limit.limit = ExactNumber(*size);
    request_.limits.push_back(std::move(limit));
  }

  std::mt19937_64 random_;
  PlanRequest request_;
  Rational f_, pupil_, n0_, e0_, delta_, epsilon_;
  std::optional<Rational> subject_;
};

}  // namespace

PlanRequest AdversarialRequest(std::uint64_t seed) {
  return Adversary(seed).Make();
}

std::string Show(const PlanRequest& request) {
  std::ostringstream text;
  const auto depth = [](const PlanDepth& d) { return d.number.decimal + (d.is_vergence ? "D" : "m"); };
  text << "f " << request.focal_length.decimal << " N " << request.f_numbers.low.decimal << ".."
       << request.f_numbers.high.decimal << " stops";
  for (const Number& stop : request.stops) text << ' ' << stop.decimal;
  text << " e " << request.extensions.low.decimal << ".." << request.extensions.high.decimal << " delta "
       << request.sensor_tolerance.decimal << " eps " << request.f_number_tolerance.decimal << " p "
       << request.pupil_factor.decimal << " objective " << static_cast<int>(request.objective);
  if (request.focus) text << " focus " << depth(*request.focus);
  if (request.depth_limit) text << " depth limit " << request.depth_limit->decimal;
  for (const BlurLimit& limit : request.limits) {
    text << "\n  " << limit.name << " side " << static_cast<int>(limit.side) << " limit " << limit.limit.decimal << ':';
    for (const DepthInterval& i : limit.depths) text << ' ' << depth(i.one_end) << ".." << depth(i.other_end);
  }
  return text.str();
}

}  // namespace lensd::optics::reference
