#include <limits>

#include "bench/plan/peers.h"
#include "optics/planner.h"

namespace lensd::bench {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

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

/// The whole planner: verdict, certificates, worst blur of every limit, model.
Solver WholePlan(const Problem& problem) {
  return [request = RequestFor(problem)]() -> Answer {
    const auto answer = optics::Plan(request);
    if (!answer || !answer->feasible) return {kNan, kNan};
    return {answer->f_number.value, answer->extension.value};
  };
}

}  // namespace

std::vector<Method> OurMethods() {
  return {{.name = "lensd plan", .prepare = WholePlan, .most_limits = 1000, .ours = true}};
}

}  // namespace lensd::bench
