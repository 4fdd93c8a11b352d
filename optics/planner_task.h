// One programme of the planner: which lines, which box and which stop, still independent of the number type.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory_resource>
#include <optional>
#include <vector>

#include "optics/planner.h"
#include "planner_strip.h"

namespace lensd::optics {

/// What a line or a bound is called in a conflict: a limit's index >= 0, or one of these.
enum Name : int { kFocusName = -1, kFNumberName = -2, kExtensionName = -3, kDomainName = -4, kDepthName = -5 };

/// Which bound a depth makes: the far end of a sharp interval bounds e from above, ...
enum class RowKind { SharpFar, SharpNear, Behind, Front };

struct RowSpec {
  RowKind kind = RowKind::SharpFar;
  const PlanDepth* depth = nullptr;
  const Number* limit = nullptr;
  int name = 0;
};

/// Points into a request that must outlive it.
struct Task {
  const PlanRequest* request = nullptr;
  std::vector<RowSpec> rows;
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
};

/// W, f² U and g of a depth, all times Z where it was given as a distance: only their quotients matter.
template <class T>
struct DepthNumbers {
  T w{};
  T v{};
  T g{};
};

/// A programme in numbers, with the names of its lines. Few lines need no memory but its own.
template <class T>
struct Programme {
 private:
  alignas(std::max_align_t) std::array<std::byte, 1024> room_;
  std::pmr::monotonic_buffer_resource pool_{room_.data(), room_.size()};

 public:
  LensNumbers<T> lens;
  std::pmr::vector<T> upper_p{&pool_}, upper_q{&pool_}, lower_p{&pool_}, lower_q{&pool_};
  std::pmr::vector<int> upper_name{&pool_}, lower_name{&pool_};
  std::size_t upper_sharp = 0, lower_sharp = 0;
  Strip<T> strip;  ///< its spans point into this programme
  int low_name = kDomainName, high_name = kExtensionName, cap_name = 0;
  std::optional<int> never;       ///< a limit that nothing can meet
  bool focus_outside = false;     ///< the focal plane is outside the box
  int focus_bound = kDomainName;  ///< which bound it breaks
  T focus_margin{};               ///< how far from the nearest bound of the box the focal plane is
  bool delicate = false;          ///< some line is so close to the focal length that rounding decides its kind

  Programme() {}  // NOLINT(cppcoreguidelines-pro-type-member-init): the room is written before it is read
  Programme(const Programme&) = delete;
  Programme& operator=(const Programme&) = delete;
};

/// `convert(Number)` gives T. The line of a depth exactly at the focal length has no place in (P, Q): it caps N.
template <class T, class Convert>
DepthNumbers<T> NumbersOf(const PlanDepth& depth, const LensNumbers<T>& lens, const Convert& convert) {
  const T skew = lens.f * (1 / lens.pupil - 1);
  const T own = lens.liquid ? T(0) : lens.f;
  if (depth.is_vergence || !(depth.number.value < std::numeric_limits<double>::max())) {
    const T u = depth.is_vergence ? convert(depth.number) : T(0);
    return {T(1 - own * u), T(lens.f * lens.f * u), T(1 + skew * u)};
  }
  const T z = convert(depth.number);
  return {T(z - own), T(lens.f * lens.f), T(z + skew)};
}

namespace task_detail {

template <class T>
void AddRow(Programme<T>& programme, const RowSpec& row, const DepthNumbers<T>& depth, const T& limit) {
  const bool sharp = row.kind == RowKind::SharpFar || row.kind == RowKind::SharpNear;
  const T reach = T(limit * (sharp ? programme.lens.narrow : programme.lens.widen) * depth.g);
  bool upper = row.kind == RowKind::SharpFar || row.kind == RowKind::Front;
  const T size = depth.w < 0 ? T(-depth.w) : depth.w;
  constexpr double kNear = 1e-14;
  if (!(size > kNear * depth.v / programme.lens.f) || (depth.w < 0 && programme.lens.pupil != 1))
    programme.delicate = true;
  if (!(depth.w > 0)) {  // inside the focal length: always in front, the more so the farther the sensor
    if (row.kind != RowKind::Front) {
      programme.never = row.name;
      return;
    }
    if (depth.w == 0) {
      const T cap = T(depth.v / reach);
      if (!programme.strip.cap || cap < *programme.strip.cap) {
        programme.strip.cap = cap;
        programme.cap_name = row.name;
      }
      return;
    }
    upper = false;
  }
  const T p = T(depth.v / depth.w) + (upper ? T(-programme.lens.delta) : programme.lens.delta);
  const bool rises = row.kind == RowKind::SharpFar || row.kind == RowKind::Behind;
  const T q = rises ? T(reach / depth.w) : T(-reach / depth.w);
  (upper ? programme.upper_p : programme.lower_p).push_back(p);
  (upper ? programme.upper_q : programme.lower_q).push_back(q);
  (upper ? programme.upper_name : programme.lower_name).push_back(row.name);
}

template <class T, class Convert>
void SetBox(Programme<T>& programme, const Task& task, const Convert& convert) {
  const PlanRequest& request = *task.request;
  Strip<T>& strip = programme.strip;
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
void SetFNumbers(Programme<T>& programme, const Task& task, const Convert& convert) {
  const PlanRequest& request = *task.request;
  Strip<T>& strip = programme.strip;
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

/// Fills `programme` from `task` in the numbers that `convert` makes of a request's.
template <class T, class Convert>
void Write(Programme<T>& programme, const Task& task, const Convert& convert) {
  const PlanRequest& request = *task.request;
  LensNumbers<T>& lens = programme.lens;
  lens.f = convert(request.focal_length);
  lens.liquid = request.liquid;
  lens.delta = convert(request.sensor_tolerance);
  lens.pupil = convert(request.pupil_factor);
  const T epsilon = convert(request.f_number_tolerance);
  lens.narrow = 1 - epsilon;
  lens.widen = 1 + epsilon;
  task_detail::SetBox(programme, task, convert);
  task_detail::SetFNumbers(programme, task, convert);
  for (auto* column : {&programme.upper_p, &programme.upper_q, &programme.lower_p, &programme.lower_q}) {
    column->reserve(task.rows.size());
  }
  for (auto* column : {&programme.upper_name, &programme.lower_name}) column->reserve(task.rows.size());
  for (const bool sharp : {true, false}) {  // sharp lines come first
    for (const RowSpec& row : task.rows) {
      if ((row.kind == RowKind::SharpFar || row.kind == RowKind::SharpNear) != sharp) continue;
      task_detail::AddRow(programme, row, NumbersOf(*row.depth, lens, convert), convert(*row.limit));
    }
    if (sharp) {
      programme.upper_sharp = programme.upper_p.size();
      programme.lower_sharp = programme.lower_p.size();
    }
  }
  programme.strip.upper = {programme.upper_p, programme.upper_q, programme.upper_sharp};
  programme.strip.lower = {programme.lower_p, programme.lower_q, programme.lower_sharp};
}

}  // namespace lensd::optics
