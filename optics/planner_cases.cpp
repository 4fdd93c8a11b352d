#include "planner_cases.h"

#include <algorithm>
#include <cmath>
#include <limits>

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

/// Adds a row for the nearest (or farthest) of the depths, and for those that might be it.
void AddExtremes(const std::vector<const PlanDepth*>& depths, bool nearest, RowSpec row, std::vector<RowSpec>& rows) {
  const PlanDepth* extreme = depths.front();
  for (const PlanDepth* depth : depths) {
    if (nearest ? Nearer(*depth, *extreme) : Nearer(*extreme, *depth)) extreme = depth;
  }
  row.depth = extreme;
  rows.push_back(row);
  for (const PlanDepth* depth : depths) {
    if (depth == extreme || !TooCloseToTell(*depth, *extreme)) continue;
    row.depth = depth;
    rows.push_back(row);
  }
}

void AddLimit(const BlurLimit& limit, int name, std::vector<RowSpec>& rows) {
  std::vector<const PlanDepth*> depths;
  for (const DepthInterval& interval : limit.depths) {
    depths.push_back(&interval.one_end);
    depths.push_back(&interval.other_end);
  }
  RowSpec row{RowKind::SharpFar, nullptr, &limit.limit, name};
  if (limit.kind == LimitKind::Blurred) {
    const bool behind = limit.side == Side::Behind;
    row.kind = behind ? RowKind::Behind : RowKind::Front;
    AddExtremes(depths, behind, row, rows);
    return;
  }
  AddExtremes(depths, false, row, rows);
  row.kind = RowKind::SharpNear;
  AddExtremes(depths, true, row, rows);
}

/// Whether, the one just in front of the focal plane and the other just behind it, no focal plane fits between.
bool Overlap(const OrderedInterval& front, const OrderedInterval& behind) {
  constexpr double kRounding = 1.0 + 1e-12;
  return Vergence(*front.far) * kRounding < Vergence(*behind.near);
}

}  // namespace

InForce Everything(const PlanRequest& request) {
  return {std::vector<bool>(request.limits.size(), true), true, true, request.focus.has_value(), true};
}

OrderedInterval Ordered(const DepthInterval& interval) {
  if (Nearer(interval.other_end, interval.one_end)) return {&interval.other_end, &interval.one_end};
  return {&interval.one_end, &interval.other_end};
}

Cases::Cases(const PlanRequest& request) : request_(request) {
  for (std::size_t i = 0; i < request.limits.size(); ++i) {
    const BlurLimit& limit = request.limits[i];
    if (limit.kind == LimitKind::Sharp || limit.side != Side::Either) {
      AddLimit(limit, static_cast<int>(i), rows_);
      continue;
    }
    for (const DepthInterval& interval : limit.depths) open_.push_back({Ordered(interval), static_cast<int>(i)});
  }
  if (request.objective == Objective::Depth) {
    rows_.push_back({RowKind::SharpFar, &*request.focus, &*request.depth_limit, kDepthName});
    rows_.push_back({RowKind::SharpNear, &*request.focus, &*request.depth_limit, kDepthName});
  }
  std::stable_sort(open_.begin(), open_.end(), [](const OpenInterval& a, const OpenInterval& b) {
    return Vergence(*a.ends.near) > Vergence(*b.ends.near);
  });
  for (const Number& stop : request.stops) stops_.push_back(&stop);
  std::sort(stops_.begin(), stops_.end(), [&](const Number* a, const Number* b) {
    return request.apertures_are_diameters ? a->value > b->value : a->value < b->value;
  });
}

void Cases::ForEach(const InForce& in_force, const std::function<bool(Task&)>& visit) const {
  const auto binds = [&](int name) {
    return name < 0 ? in_force.depth : in_force.limits[static_cast<std::size_t>(name)];
  };
  Task task;
  task.request = &request_;
  task.f_number_binds = in_force.f_number;
  task.extension_binds = in_force.extension;
  task.focus_binds = in_force.focus;
  std::copy_if(rows_.begin(), rows_.end(), std::back_inserter(task.rows),
               [&](const RowSpec& row) { return binds(row.name); });
  const std::size_t given = task.rows.size();
  std::vector<OpenInterval> open;
  std::copy_if(open_.begin(), open_.end(), std::back_inserter(open),
               [&](const OpenInterval& o) { return binds(o.limit); });

  for (std::size_t in_front = 0; in_front <= open.size(); ++in_front) {
    if (in_front > 0 && in_front < open.size() && Overlap(open[in_front - 1].ends, open[in_front].ends)) continue;
    task.rows.resize(given);
    for (std::size_t i = 0; i < open.size(); ++i) {
      const bool front = i < in_front;
      task.rows.push_back({front ? RowKind::Front : RowKind::Behind, front ? open[i].ends.far : open[i].ends.near,
                           &request_.limits[static_cast<std::size_t>(open[i].limit)].limit, open[i].limit});
    }
    if (stops_.empty() || !in_force.f_number) {
      task.stop = nullptr;
      if (!visit(task)) return;
      continue;
    }
    for (const Number* stop : stops_) {
      task.stop = stop;
      if (!visit(task)) return;
    }
  }
}

}  // namespace lensd::optics
