// lensd's planner, called as lensctl and lensd call it.

#include "bench/plan/peers.h"
#include "optics/planner.h"

namespace lensd::bench {
namespace {

constexpr std::size_t kMostLimits = 10'000'000;

optics::BlurLimit LimitOf(const Limit& limit, std::size_t index) {
  const bool sharp = limit.kind == Kind::Sharp;
  return {.name = "limit[" + std::to_string(index) + "]",
          .kind = sharp ? optics::LimitKind::Sharp : optics::LimitKind::Blurred,
          .depths = {{optics::PlanDepth::Vergence(limit.far), optics::PlanDepth::Vergence(limit.near)}},
          .limit = limit.limit,
          .side = sharp                        ? optics::Side::Either
                  : limit.kind == Kind::Behind ? optics::Side::Behind
                                               : optics::Side::Front};
}

optics::PlanRequest RequestFor(const Problem& problem) {
  optics::PlanRequest request;
  request.focal_length = problem.f;
  request.f_numbers = {problem.n_low, problem.n_high};
  request.extensions = {problem.e_low, problem.e_high};
  request.sensor_tolerance = problem.delta;
  for (std::size_t i = 0; i < problem.limits.size(); ++i) request.limits.push_back(LimitOf(problem.limits[i], i));
  return request;
}

Solver Planned(const Problem& problem) {
  return [request = RequestFor(problem)]() -> Answer {
    const auto answer = optics::Plan(request);
    if (!answer || !answer->feasible) return {kNan, kNan};
    return {answer->f_number.value, answer->extension.value};
  };
}

Solver Read(const Problem& problem) {
  return [request = RequestFor(problem)]() -> Answer {
    double near = 0.0, far = 0.0, limits = 0.0;
    for (const optics::BlurLimit& limit : request.limits) {
      far += limit.depths.front().one_end.number.value;
      near += limit.depths.front().other_end.number.value;
      limits += limit.limit.value;
    }
    return {near + far, limits};
  };
}

}  // namespace

Method Lensd() {
  return {.name = "lensd", .prepare = Planned, .most_limits = kMostLimits, .ours = true};
}

Method ReadRequestOnce() {
  return {.name = "reading the numbers once", .prepare = Read, .most_limits = kMostLimits, .plans = false};
}

}  // namespace lensd::bench
