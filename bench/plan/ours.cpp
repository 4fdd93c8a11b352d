#include <limits>

#include "bench/plan/peers.h"
#include "optics/planner.h"
#include "optics/planner_columns.h"

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

/// The whole planner as the command line and the daemon use it: names, worst blur of every limit, model.
Solver WholePlan(const Problem& problem) {
  return [request = RequestFor(problem)]() -> Answer {
    const auto answer = optics::Plan(request);
    if (!answer || !answer->feasible) return {kNan, kNan};
    return {answer->f_number.value, answer->extension.value};
  };
}

optics::ColumnLens LensOf(const Problem& problem) {
  return {.focal_length = problem.f,
          .n_low = problem.n_low,
          .n_high = problem.n_high,
          .e_low = problem.e_low,
          .e_high = problem.e_high,
          .sensor_tolerance = problem.delta};
}

Answer AnswerOf(const optics::ColumnPlan& plan) {
  return plan.feasible ? Answer{plan.n, plan.e} : Answer{kNan, kNan};
}

/// The limits as columns, made ready before.
struct Columns {
  std::vector<double> sharp_near, sharp_far, sharp_limit, behind_near, behind_limit, front_far, front_limit;

  void Add(const Limit& limit) {
    switch (limit.kind) {
      case Kind::Sharp:
        sharp_near.push_back(limit.near);
        sharp_far.push_back(limit.far);
        sharp_limit.push_back(limit.limit);
        break;
      case Kind::Behind:
        behind_near.push_back(limit.near);
        behind_limit.push_back(limit.limit);
        break;
      case Kind::Front:
        front_far.push_back(limit.far);
        front_limit.push_back(limit.limit);
        break;
    }
  }
  optics::LimitColumns View() const {
    return {sharp_near, sharp_far, sharp_limit, behind_near, behind_limit, front_far, front_limit};
  }
};

Answer PlanSamples(const Problem& problem) {
  const std::span<const double> vergence(problem.sample_vergence);
  if (problem.sample_limit.size() > 1) {
    return AnswerOf(optics::PlanColumns(LensOf(problem), {.sharp_near = vergence,
                                                          .sharp_far = vergence,
                                                          .sharp_limit = problem.sample_limit,
                                                          .behind_near = {},
                                                          .behind_limit = {},
                                                          .front_far = {},
                                                          .front_limit = {}}));
  }
  const optics::Extremes ends = optics::ExtremesOf(vergence);
  return AnswerOf(optics::PlanColumns(LensOf(problem), {.sharp_near = {&ends.greatest, 1},
                                                        .sharp_far = {&ends.least, 1},
                                                        .sharp_limit = problem.sample_limit,
                                                        .behind_near = {},
                                                        .behind_limit = {},
                                                        .front_far = {},
                                                        .front_limit = {}}));
}

/// The planner for loops and large inputs: verdict, f-number, extension and ratio.
Solver PlanByColumns(const Problem& problem) {
  if (!problem.sample_vergence.empty()) return [&problem] { return PlanSamples(problem); };
  Columns columns;
  for (const Limit& limit : problem.limits) columns.Add(limit);
  return [lens = LensOf(problem), columns = std::move(columns)] {
    return AnswerOf(optics::PlanColumns(lens, columns.View()));
  };
}

}  // namespace

std::vector<Method> OurMethods() {
  return {{.name = "lensd columns", .prepare = PlanByColumns, .most_limits = 10'000'000, .ours = true},
          {.name = "lensd plan", .prepare = WholePlan, .most_limits = 1000, .ours = true}};
}

}  // namespace lensd::bench
