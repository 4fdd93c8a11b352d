// Smallest N over columns. Many limits: few of them matter. A sample is solved, every limit is tried on its solution
// (without a division), and the ones it breaks most, one of each block, join the sample; with 2,048 to start from two
// or three rounds settle it.
#include "optics/planner_columns.h"

#include <algorithm>
#include <array>
#include <vector>

#include "planner_columns_exact.h"
#include "planner_columns_rows.h"

namespace lensd::optics {

namespace {

std::size_t CountOf(const LimitColumns& limits) {
  return limits.sharp_limit.size() + limits.behind_limit.size() + limits.front_limit.size();
}

/// Some of the limits, as columns of their own.
class WorkingSet {
 public:
  explicit WorkingSet(const LimitColumns& all) : all_(all) {}

  void Add(LimitIndex index) {
    const std::size_t i = index.row;
    switch (index.kind) {
      case LimitIndex::Sharp:
        sharp_near_.push_back(all_.sharp_near[i]);
        sharp_far_.push_back(all_.sharp_far[i]);
        sharp_limit_.push_back(all_.sharp_limit[i]);
        break;
      case LimitIndex::Behind:
        behind_near_.push_back(all_.behind_near[i]);
        behind_limit_.push_back(all_.behind_limit[i]);
        break;
      case LimitIndex::Front:
        front_far_.push_back(all_.front_far[i]);
        front_limit_.push_back(all_.front_limit[i]);
        break;
    }
  }

  Settled Solve(const ColumnLens& lens) {
    const LimitColumns some{sharp_near_,   sharp_far_, sharp_limit_, behind_near_,
                            behind_limit_, front_far_, front_limit_};
    room_.resize(RoomFor(CountOf(some)));
    return SolveColumns(lens, some, room_.data());
  }

 private:
  const LimitColumns& all_;
  std::vector<double> sharp_near_, sharp_far_, sharp_limit_, behind_near_, behind_limit_, front_far_, front_limit_;
  std::vector<double> room_;
};

void AddSample(const LimitColumns& limits, WorkingSet& chosen) {
  constexpr std::size_t kSample = 2048;
  const std::array<std::size_t, 3> counts{limits.sharp_limit.size(), limits.behind_limit.size(),
                                          limits.front_limit.size()};
  const std::size_t all = CountOf(limits);
  std::uint64_t random = 0x9E3779B97F4A7C15u;
  for (const LimitIndex::Kind kind : {LimitIndex::Sharp, LimitIndex::Behind, LimitIndex::Front}) {
    const std::size_t count = counts[kind], wanted = std::min(count, kSample * count / all + 16);
    for (std::size_t i = 0; i < wanted; ++i) {
      random = random * 6364136223846793005u + 1442695040888963407u;
      chosen.Add({kind, static_cast<std::uint32_t>((random >> 33) % count)});
    }
  }
}

ColumnPlan PlanMany(const ColumnLens& lens, const LimitColumns& limits) {
  WorkingSet chosen(limits);
  AddSample(limits, chosen);
  constexpr int kMostRounds = 60;
  std::vector<LimitIndex> broken;
  for (int round = 0; round < kMostRounds; ++round) {
    const Settled settled = chosen.Solve(lens);
    if (settled.verdict == Verdict::Infeasible) return {};
    if (settled.verdict == Verdict::Unsure) break;
    // Past n_low the vertex itself is on the verge: what must hold is the point a hair inside.
    const bool vertex = settled.n != lens.n_low;
    broken.clear();
    CollectBroken(lens, limits, vertex ? settled.beyond : settled.n, vertex ? settled.inside : settled.e,
                  vertex ? 1.0 : settled.ratio, broken);
    if (broken.empty()) return {true, settled.n, settled.e, settled.ratio};
    for (const LimitIndex index : broken) chosen.Add(index);
  }
  return PlanColumnsExactly(lens, limits);
}

}  // namespace

ColumnPlan PlanColumns(const ColumnLens& lens, const LimitColumns& limits) {
  constexpr std::size_t kFew = 128;
  if (CountOf(limits) > kFew) return PlanMany(lens, limits);
  std::array<double, RoomFor(kFew)> room;  // NOLINT(cppcoreguidelines-pro-type-member-init): written before it is read
  const Settled settled = SolveColumns(lens, limits, room.data());
  if (settled.verdict == Verdict::Unsure) return PlanColumnsExactly(lens, limits);
  return {settled.verdict == Verdict::Feasible, settled.n, settled.e, settled.ratio};
}

}  // namespace lensd::optics
