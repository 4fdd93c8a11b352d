// One programme of the planner: which lines, which box and which stop, still independent of the number type.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "optics/plan_request.h"
#include "optics/planner/linear_program.h"

namespace lensd::optics {

/// What a line or a bound is called in a conflict: a limit's index >= 0, or one of these.
enum Name : int { kFocusName = -1, kFNumberName = -2, kExtensionName = -3, kDomainName = -4, kDepthName = -5 };

/// Which bound a depth makes: the far end of a sharp interval bounds e from above, ...
enum class RowKind { SharpFar, SharpNear, Behind, Front };

/// Whether a limit is blurred on either side, in one comparison: limits of all kinds come in any order, which no
/// processor guesses.
inline bool IsOpen(const BlurLimit& limit) {
  static_assert(LimitKind::Sharp == LimitKind(0) && Side::Either == Side(0));
  return static_cast<int>(limit.kind) > static_cast<int>(limit.side);
}
/// The place of what all limits of its kind have in common: 0 sharp, 1 blurred behind, 2 in front. Not of an open one.
inline std::size_t KindIndex(const BlurLimit& limit) {
  return static_cast<std::size_t>(limit.kind) * static_cast<std::size_t>(limit.side);
}

struct LimitRow {
  RowKind kind;
  const PlanDepth* depth;
  const Number* limit;
  int name;
};

/// Points into a request and rows that must outlive it.
struct Subproblem {
  const PlanRequest* request = nullptr;
  std::span<const LimitRow> rows = {};
  const Number* stop = nullptr;  ///< one of the stops, instead of the range
  bool f_number_binds = true;    ///< else any N > 0
  bool extension_binds = true;   ///< else any e >= min(0, low end)
  bool focus_binds = true;       ///< else no focal plane is asked for
};

/// The numbers every line needs.
template <class T>
struct LensNumbers {
  T f{};
  T delta{};
  T pupil{};
  T narrow{};           ///< 1 - epsilon, on sharp limits
  T widen{};            ///< 1 + epsilon, on blurred ones
  bool liquid = false;  ///< the length of the lens does not enter: W = 1
  T skew{};             ///< f (1/p - 1)
};

/// W, f² U and g of a depth, all times Z where it was given as a distance: only their quotients matter.
template <class T>
struct DepthNumbers {
  T w{};
  T v{};
  T g{};
};

/// A programme in numbers, with the names of its lines.
template <class T>
struct LinearProgram {
 private:
  std::unique_ptr<T[]> numbers_;
  std::unique_ptr<int[]> names_;

 public:
  /// Makes room for so many lines, which are to be written.
  void Resize(std::size_t upper, std::size_t lower) {
    numbers_ = std::make_unique_for_overwrite<T[]>(2 * (upper + lower));
    names_ = std::make_unique_for_overwrite<int[]>(upper + lower);
    T* const numbers = numbers_.get();
    upper_p = {numbers, upper}, upper_q = {numbers + upper, upper};
    lower_p = {numbers + 2 * upper, lower}, lower_q = {numbers + 2 * upper + lower, lower};
    upper_name = {names_.get(), upper}, lower_name = {names_.get() + upper, lower};
  }
  /// Leaves only the first lines.
  void Shorten(std::size_t upper, std::size_t lower) {
    for (auto* column : {&upper_p, &upper_q}) *column = column->first(upper);
    for (auto* column : {&lower_p, &lower_q}) *column = column->first(lower);
    upper_name = upper_name.first(upper), lower_name = lower_name.first(lower);
  }
  /// Makes the lines the strip's, the first ones sharp.
  void Use(std::size_t upper_sharp, std::size_t lower_sharp) {
    strip.upper = {upper_p, upper_q, upper_sharp};
    strip.lower = {lower_p, lower_q, lower_sharp};
  }

  LensNumbers<T> lens;
  std::span<T> upper_p, upper_q, lower_p, lower_q;
  std::span<int> upper_name, lower_name;
  FeasibleStrip<T> strip;  ///< its spans point into this programme
  int low_name = kDomainName, high_name = kExtensionName, cap_name = 0;
  std::optional<int> unmeetable;  ///< a limit that nothing can meet
  bool focus_outside = false;     ///< the focal plane is outside the box
  int focus_bound = kDomainName;  ///< which bound it breaks
  T focus_margin{};               ///< how far from the nearest bound of the box the focal plane is
  bool ill_conditioned = false;   ///< some line is so close to the focal length that rounding decides its kind

  LinearProgram() = default;
  LinearProgram(const LinearProgram&) = delete;
  LinearProgram& operator=(const LinearProgram&) = delete;
};

/// `convert(Number)` gives T. The line of a depth exactly at the focal length has no place in (P, Q): it caps N.
template <class T, class Convert>
DepthNumbers<T> NumbersOf(const PlanDepth& depth, const LensNumbers<T>& lens, const Convert& convert) {
  const T own = lens.liquid ? T(0) : lens.f;
  if (depth.is_vergence || !(depth.number.value < std::numeric_limits<double>::max())) {
    const T u = depth.is_vergence ? convert(depth.number) : T(0);
    return {T(1 - own * u), T(lens.f * lens.f * u), T(1 + lens.skew * u)};
  }
  const T z = convert(depth.number);
  return {T(z - own), T(lens.f * lens.f), T(z + lens.skew)};
}

/// What a limit at one depth bounds.
enum class Bounds {
  Above,    ///< e <= p + q N
  Below,    ///< e >= p + q N
  FNumber,  ///< N <= p: a blurred limit exactly at the focal length
  Nothing,  ///< no setting meets it
};

template <class T>
struct LimitLine {
  Bounds bounds = Bounds::Above;
  T p{};
  T q{};
};

/// The line of a limit at one depth, the tolerances taken off.
template <class T>
LimitLine<T> LineOf(RowKind kind, const DepthNumbers<T>& depth, const LensNumbers<T>& lens, const T& limit) {
  const bool sharp = kind == RowKind::SharpFar || kind == RowKind::SharpNear;
  const T reach = T(limit * (sharp ? lens.narrow : lens.widen) * depth.g);
  bool above = kind == RowKind::SharpFar || kind == RowKind::Front;
  if (!(depth.w > 0)) {  // inside the focal length: always in front, the more so the farther the sensor
    if (kind != RowKind::Front) return {Bounds::Nothing, T(), T()};
    if (depth.w == 0) return {Bounds::FNumber, T(depth.v / reach), T()};
    above = false;
  }
  const bool rises = kind == RowKind::SharpFar || kind == RowKind::Behind;
  return {above ? Bounds::Above : Bounds::Below, T(depth.v / depth.w) + (above ? T(-lens.delta) : lens.delta),
          rises ? T(reach / depth.w) : T(-reach / depth.w)};
}

namespace task_detail {

/// How many lines there are so far.
struct LineCount {
  std::size_t upper = 0, lower = 0;
};

template <class T>
void AddRow(LinearProgram<T>& programme, const LimitRow& row, const DepthNumbers<T>& depth, const T& limit,
            LineCount& count) {
  const T size = depth.w < 0 ? T(-depth.w) : depth.w;
  constexpr double kNear = 1e-14;
  if (!(size * programme.lens.f > kNear * depth.v) || (depth.w < 0 && programme.lens.pupil != 1))
    programme.ill_conditioned = true;
  const LimitLine<T> line = LineOf(row.kind, depth, programme.lens, limit);
  switch (line.bounds) {
    case Bounds::Nothing:
      programme.unmeetable = row.name;
      return;
    case Bounds::FNumber:
      if (!programme.strip.cap || line.p < *programme.strip.cap) {
        programme.strip.cap = line.p;
        programme.cap_name = row.name;
      }
      return;
    case Bounds::Above:
      programme.upper_p[count.upper] = line.p;
      programme.upper_q[count.upper] = line.q;
      programme.upper_name[count.upper++] = row.name;
      return;
    case Bounds::Below:
      programme.lower_p[count.lower] = line.p;
      programme.lower_q[count.lower] = line.q;
      programme.lower_name[count.lower++] = row.name;
      return;
  }
}

template <class T, class Convert>
void WriteLines(LinearProgram<T>& programme, std::span<const LimitRow> rows, const Convert& convert) {
  programme.Resize(rows.size(), rows.size());
  LineCount count, sharp_count;
  for (const bool sharp : {true, false}) {  // sharp lines come first
    for (const LimitRow& row : rows) {
      if ((row.kind == RowKind::SharpFar || row.kind == RowKind::SharpNear) != sharp) continue;
      AddRow(programme, row, NumbersOf(*row.depth, programme.lens, convert), convert(*row.limit), count);
    }
    if (sharp) sharp_count = count;
  }
  programme.Shorten(count.upper, count.lower);
  programme.Use(sharp_count.upper, sharp_count.lower);
}

template <class T, class Convert>
void SetBox(LinearProgram<T>& programme, const Subproblem& task, const Convert& convert) {
  const PlanRequest& request = *task.request;
  FeasibleStrip<T>& strip = programme.strip;
  const T range_low = convert(request.extensions.low);
  strip.low = range_low < 0 ? range_low : T(0);
  if (task.extension_binds) {
    if (range_low > strip.low) programme.low_name = kExtensionName;
    strip.low = range_low;
    strip.high = convert(request.extensions.high);
  }
  strip.high_unbounded = !task.extension_binds;
  if (!task.focus_binds || !request.focus) return;
  const DepthNumbers<T> focus = NumbersOf(*request.focus, programme.lens, convert);
  const T e = T(focus.v / focus.w);
  const T below = strip.low - e;
  programme.focus_margin = below < 0 ? T(-below) : below;
  if (below > 0) {
    programme.focus_outside = true;
    programme.focus_bound = programme.low_name;
  }
  if (!strip.high_unbounded) {
    const T above = e - strip.high;
    programme.focus_margin = std::min<T>(programme.focus_margin, above < 0 ? T(-above) : above);
    if (above > 0) {
      programme.focus_outside = true;
      programme.focus_bound = programme.high_name;
    }
  }
  strip.low = strip.high = e;
  strip.high_unbounded = false;
  programme.low_name = programme.high_name = kFocusName;
}

template <class T, class Convert>
void SetFNumbers(LinearProgram<T>& programme, const Subproblem& task, const Convert& convert) {
  const PlanRequest& request = *task.request;
  FeasibleStrip<T>& strip = programme.strip;
  if (!task.f_number_binds) {
    strip.n_low = T(0);
    strip.n_above_low = strip.n_unbounded = true;
    return;
  }
  T first = convert(task.stop != nullptr ? *task.stop : request.f_numbers.low);
  T last = convert(task.stop != nullptr ? *task.stop : request.f_numbers.high);
  if (request.apertures_are_diameters) {
    first = programme.lens.f / first;
    last = programme.lens.f / last;
    std::swap(first, last);
  }
  strip.n_low = first;
  strip.n_high = last;
}

}  // namespace task_detail

template <class T, class Convert>
LensNumbers<T> LensOf(const PlanRequest& request, const Convert& convert) {
  const T epsilon = convert(request.f_number_tolerance), f = convert(request.focal_length);
  const T pupil = convert(request.pupil_factor);
  return {f,
          convert(request.sensor_tolerance),
          pupil,
          T(1 - epsilon),
          T(1 + epsilon),
          request.liquid,
          T(f * (1 / pupil - 1))};
}

/// The lens, the box and the range of f-numbers, before the lines are written.
template <class T, class Convert>
void WriteLens(LinearProgram<T>& programme, const Subproblem& task, const Convert& convert) {
  programme.lens = LensOf<T>(*task.request, convert);
  task_detail::SetBox(programme, task, convert);
  task_detail::SetFNumbers(programme, task, convert);
}

/// Fills `programme` from `task` in the numbers that `convert` makes of a request's.
template <class T, class Convert>
void Write(LinearProgram<T>& programme, const Subproblem& task, const Convert& convert) {
  WriteLens(programme, task, convert);
  task_detail::WriteLines(programme, task.rows, convert);
}

}  // namespace lensd::optics
