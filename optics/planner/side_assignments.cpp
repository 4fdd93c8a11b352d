// A sharp limit becomes lines for its nearest and farthest depth; an open side may lie before or behind the focal
// plane, and each way to divide such limits is a case of its own. Gaps that no focal plane fits are left out early.
#include "optics/planner/side_assignments.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

namespace lensd::optics {

namespace {

double Vergence(const PlanDepth& depth) {
  return depth.vergence().value;
}

/// Whether a is nearer than b. Two distances, or two vergences, compare as they were given.
bool Nearer(const PlanDepth& a, const PlanDepth& b) {
  if (!a.is_vergence && !b.is_vergence) return a.number.value < b.number.value;
  return Vergence(a) > Vergence(b);
}

/// Whether rounding, or digits beyond a double's, may have turned the order round.
bool TooCloseToTell(const PlanDepth& a, const PlanDepth& b) {
  const bool same = a.is_vergence == b.is_vergence && a.number.value == b.number.value;
  if (same && a.number.decimal == b.number.decimal) return false;
  constexpr double kUlps = 4.0 * std::numeric_limits<double>::epsilon();
  return std::abs(Vergence(a) - Vergence(b)) <= kUlps * std::max(std::abs(Vergence(a)), std::abs(Vergence(b)));
}

enum class Extreme { Nearest, Farthest };

/// Adds a row for that one of the depths, and for those that might be it.
void AddExtremes(const std::vector<const PlanDepth*>& depths, Extreme which, LimitRow row,
                 std::vector<LimitRow>& rows) {
  const PlanDepth* extreme = depths.front();
  for (const PlanDepth* depth : depths) {
    if (which == Extreme::Nearest ? Nearer(*depth, *extreme) : Nearer(*extreme, *depth)) extreme = depth;
  }
  row.depth = extreme;
  rows.push_back(row);
  for (const PlanDepth* depth : depths) {
    if (depth == extreme || !TooCloseToTell(*depth, *extreme)) continue;
    row.depth = depth;
    rows.push_back(row);
  }
}

/// `depths` is room to work in, kept from one limit to the next.
void AddLimit(const BlurLimit& limit, int name, std::vector<const PlanDepth*>& depths, std::vector<LimitRow>& rows) {
  depths.clear();
  for (const DepthInterval& interval : limit.depths) {
    depths.push_back(&interval.one_end);
    depths.push_back(&interval.other_end);
  }
  LimitRow row{RowKind::SharpFar, nullptr, &limit.limit, name};
  if (limit.kind == LimitKind::Blurred) {
    const bool behind = limit.side == Side::Behind;
    row.kind = behind ? RowKind::Behind : RowKind::Front;
    AddExtremes(depths, behind ? Extreme::Nearest : Extreme::Farthest, row, rows);
    return;
  }
  AddExtremes(depths, Extreme::Farthest, row, rows);
  row.kind = RowKind::SharpNear;
  AddExtremes(depths, Extreme::Nearest, row, rows);
}

/// The open intervals of one limit, nearest first, the first `in_front` of them in front of the focal plane. Of those
/// only the farthest ends matter, of the others only the nearest: blur grows with the distance from the plane.
class OpenLimit {
 public:
  OpenLimit(const Number* limit, int name) : limit_(limit), name_(name) {}

  void Add(const OrderedInterval& interval) { intervals_.push_back(interval); }

  /// Moves the nearest interval that is behind the focal plane to its front.
  void Advance() {
    const PlanDepth* far = intervals_[in_front_++].far;
    const bool apart = !farthest_.empty() && !TooCloseToTell(*far, *farthest_.front());
    if (apart && !Nearer(*farthest_.front(), *far)) return;
    if (apart) farthest_.clear();
    farthest_.push_back(far);
  }

  void AddRows(std::vector<LimitRow>& rows) const {
    for (const PlanDepth* far : farthest_) rows.push_back({RowKind::Front, far, limit_, name_});
    for (std::size_t i = in_front_; i < intervals_.size(); ++i) {
      const PlanDepth* near = intervals_[i].near;
      if (i > in_front_ && !TooCloseToTell(*near, *intervals_[in_front_].near)) break;
      rows.push_back({RowKind::Behind, near, limit_, name_});
    }
  }

 private:
  const Number* limit_;
  int name_;
  std::vector<OrderedInterval> intervals_;
  std::size_t in_front_ = 0;
  std::vector<const PlanDepth*> farthest_;
};

/// Where in e a focal plane can be between two intervals, roughly: a cheap test that spares most gaps of a depth map.
class GapTest {
 public:
  explicit GapTest(const PlanRequest& request)
      : f_(request.focal_length.value),
        own_(request.liquid ? 0.0 : f_),
        skew_(f_ * (1.0 / request.pupil_factor.value - 1.0)),
        delta_(request.sensor_tolerance.value),
        widen_(1.0 + request.f_number_tolerance.value) {}

  /// Whether, at this N and all larger ones, no focal plane fits with `front` just before it and `behind` just after,
  /// by more than rounding.
  bool TooNarrow(double n, const PlanDepth& front, double front_limit, const PlanDepth& behind,
                 double behind_limit) const {
    const double u = Vergence(front), v = Vergence(behind);
    const double w_front = 1.0 - own_ * u, w_behind = 1.0 - own_ * v;
    constexpr double kRounding = 1e-9;
    if (w_front < kRounding || w_behind < kRounding) return false;
    const double high = (f_ * f_ * u - front_limit * n * widen_ * (1.0 + skew_ * u)) / w_front - delta_;
    const double low = (f_ * f_ * v + behind_limit * n * widen_ * (1.0 + skew_ * v)) / w_behind + delta_;
    return high < low - kRounding * (f_ * f_ * (u / w_front + v / w_behind) + delta_);
  }

 private:
  double f_, own_, skew_, delta_, widen_;
};

}  // namespace

ActiveLimits Everything(const PlanRequest& request) {
  return {std::vector<char>(request.limits.size(), 1), true, true, request.focus.has_value(), true};
}

OrderedInterval Ordered(const DepthInterval& interval) {
  if (Nearer(interval.other_end, interval.one_end)) return {&interval.other_end, &interval.one_end};
  return {&interval.one_end, &interval.other_end};
}

SideAssignments::SideAssignments(const PlanRequest& request) : request_(request) {
  std::vector<const PlanDepth*> depths;
  std::vector<LimitRow> blurred;  // after the sharp ones: what comes in runs is quicker to tell apart
  rows_.reserve(2 * request.limits.size() + 2);
  for (std::size_t i = 0; i < request.limits.size(); ++i) {
    const BlurLimit& limit = request.limits[i];
    if (IsOpen(limit)) {
      for (const DepthInterval& interval : limit.depths) open_.push_back({Ordered(interval), static_cast<int>(i)});
    } else {
      AddLimit(limit, static_cast<int>(i), depths, limit.kind == LimitKind::Sharp ? rows_ : blurred);
    }
  }
  rows_.insert(rows_.end(), blurred.begin(), blurred.end());
  if (request.objective == Objective::Depth) {
    rows_.push_back({RowKind::SharpFar, &*request.focus, &*request.depth_limit, kDepthName});
    rows_.push_back({RowKind::SharpNear, &*request.focus, &*request.depth_limit, kDepthName});
  }
  std::sort(open_.begin(), open_.end(), [](const OpenInterval& a, const OpenInterval& b) {
    return Vergence(*a.ends.near) > Vergence(*b.ends.near);
  });
  for (const Number& stop : request.stops) stops_.push_back(&stop);
  std::sort(stops_.begin(), stops_.end(), [&](const Number* a, const Number* b) {
    return request.apertures_are_diameters ? a->value > b->value : a->value < b->value;
  });
}

void SideAssignments::ForEach(const ActiveLimits& in_force, const std::function<bool(Subproblem&)>& visit,
                              const double& most_ratio) const {
  const auto binds = [&](int name) {
    return name < 0 ? in_force.depth : in_force.limits[static_cast<std::size_t>(name)] != 0;
  };
  Subproblem task;
  task.request = &request_;
  task.f_number_binds = in_force.f_number;
  task.extension_binds = in_force.extension;
  task.focus_binds = in_force.focus;
  const bool all = in_force.depth && std::ranges::find(in_force.limits, 0) == in_force.limits.end();
  if (all && open_.empty()) {
    task.rows = rows_;
    VisitStops(task, visit);
    return;
  }
  std::vector<LimitRow> rows;
  rows.reserve(rows_.size() + 2);
  std::ranges::copy_if(rows_, std::back_inserter(rows), [&](const LimitRow& row) { return binds(row.name); });
  const std::size_t given = rows.size();
  std::vector<const OpenInterval*> open;
  std::map<int, OpenLimit> limits;
  for (const OpenInterval& interval : open_) {
    if (!binds(interval.limit)) continue;
    open.push_back(&interval);
    limits.try_emplace(interval.limit, &LimitOf(interval), interval.limit).first->second.Add(interval.ends);
  }
  const GapTest gap(request_);
  const double smallest_n = in_force.f_number ? SmallestN() : 0.0;

  for (std::size_t in_front = 0; in_front <= open.size(); ++in_front) {
    if (in_front > 0) {
      const OpenInterval& last = *open[in_front - 1];
      limits.at(last.limit).Advance();
      if (in_front < open.size()) {
        const OpenInterval& next = *open[in_front];
        if (gap.TooNarrow(smallest_n / most_ratio, *last.ends.far, LimitOf(last).value, *next.ends.near,
                          LimitOf(next).value))
          continue;
      }
    }
    rows.resize(given);
    for (const auto& [name, limit] : limits) limit.AddRows(rows);
    task.rows = rows;
    if (!VisitStops(task, visit)) return;
  }
}

std::optional<ActiveLimits> SideAssignments::WithoutOpen(const ActiveLimits& in_force) const {
  if (open_.empty()) return std::nullopt;
  ActiveLimits given = in_force;
  for (const OpenInterval& interval : open_) given.limits[static_cast<std::size_t>(interval.limit)] = 0;
  return given.limits == in_force.limits ? std::nullopt : std::optional(given);
}

bool SideAssignments::VisitStops(Subproblem& task, const std::function<bool(Subproblem&)>& visit) const {
  task.stop = nullptr;
  if (stops_.empty() || !task.f_number_binds) return visit(task);
  for (const Number* stop : stops_) {
    task.stop = stop;
    if (!visit(task)) return false;
  }
  return true;
}

const Number& SideAssignments::LimitOf(const OpenInterval& interval) const {
  return request_.limits[static_cast<std::size_t>(interval.limit)].limit;
}

double SideAssignments::SmallestN() const {
  const bool diameters = request_.apertures_are_diameters;
  const double widest = !stops_.empty() ? stops_.front()->value
                        : diameters     ? request_.f_numbers.high.value
                                        : request_.f_numbers.low.value;
  return diameters ? request_.focal_length.value / widest : widest;
}

}  // namespace lensd::optics
