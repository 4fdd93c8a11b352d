// Answers that doubles are too short for. A longer mantissa takes ten times longer than they do and rationals a
// thousand times, and of many rows few matter: some are solved, then every row is tried on that solution in double
// precision. Those it may break, or holds so narrowly that rounding could tell either way, join the others; when there
// are none left the solution is that of all rows.
#include "optics/planner/many_limits.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <set>
#include <string>
#include <tuple>

#include "optics/planner/filtered_solve.h"
#include "optics/planner/solve_exact.h"

namespace lensd::optics {

namespace {

constexpr std::size_t kFew = 128;

/// Rows that say the same are one.
using Identity = std::tuple<RowKind, bool, double, std::string, double, std::string>;

Identity IdentityOf(const LimitRow& row) {
  return {row.kind,         row.depth->is_vergence, row.depth->number.value, row.depth->number.decimal,
          row.limit->value, row.limit->decimal};
}

class Rows {
 public:
  explicit Rows(const Subproblem& task) : task_(task) {
    const auto convert = [](const Number& number) { return number.value; };
    lens_ = LensOf<double>(*task.request, convert);
    for (const LimitRow& row : task.rows) depths_.push_back(NumbersOf(*row.depth, lens_, convert));
  }

  /// Adds to `chosen` the rows that `solved` leaves in doubt, and the worst of those it breaks; false when none is new.
  bool Add(const Solution& solved, std::vector<LimitRow>& chosen) {
    std::vector<std::pair<double, std::size_t>> doubtful;
    for (std::size_t i = 0; i < depths_.size(); ++i) {
      const double slack = RelativeSlack(i, solved);
      constexpr double kDoubt = 1e-9;
      if (!(slack > kDoubt)) doubtful.emplace_back(slack, i);
    }
    std::sort(doubtful.begin(), doubtful.end());
    bool grown = false;
    std::size_t broken = 0;
    for (const auto& [slack, i] : doubtful) {
      constexpr double kBroken = -1e-9;
      if (slack < kBroken && ++broken > kFew / 4) continue;
      if (!chosen_.insert(IdentityOf(task_.rows[i])).second) continue;
      chosen.push_back(task_.rows[i]);
      grown = true;
    }
    return grown;
  }

 private:
  /// By how much the row holds at the solution, limits at its ratio; relative to what is being compared.
  double RelativeSlack(std::size_t i, const Solution& solved) const {
    const LimitRow& row = task_.rows[i];
    const DepthNumbers<double>& depth = depths_[i];
    const bool sharp = row.kind == RowKind::SharpFar || row.kind == RowKind::SharpNear;
    const double ratio = std::max(solved.ratio, 1e-300);
    const double n = sharp ? solved.n * ratio : solved.n / ratio;
    const double reach = row.limit->value * (sharp ? lens_.narrow : lens_.widen) * depth.g * n;
    const auto blur = [&](double e) { return depth.w * e - depth.v; };
    const double out = blur(solved.e + lens_.delta), in = blur(solved.e - lens_.delta);
    const double scale = std::abs(depth.w * solved.e) + depth.v + reach + lens_.delta;
    switch (row.kind) {
      case RowKind::SharpFar:
        return (reach - out) / scale;
      case RowKind::SharpNear:
        return (reach + in) / scale;
      case RowKind::Behind:
        return (in - reach) / scale;
      case RowKind::Front:
        return (-std::max(in, out) - reach) / scale;
    }
    return 0.0;
  }

  const Subproblem& task_;
  LensNumbers<double> lens_;
  std::vector<DepthNumbers<double>> depths_;
  std::set<Identity> chosen_;
};

/// With the longer mantissa where that is enough, else exactly.
Solution SolveRows(const Subproblem& task, WantedN wanted) {
  Attempt<Solution> attempt = TrySolveForN<Extended>(task, wanted, ToExtended);
  return attempt.certain ? std::move(attempt.answer) : SolveRowsExactly(task, wanted);
}

}  // namespace

Extended ToExtended(const Number& number) {
  std::array<char, 32> shortest;  // NOLINT(*-member-init): written before it is read
  const char* from = number.decimal.data();
  const char* to = from + number.decimal.size();
  if (number.decimal.empty()) {
    from = shortest.data();
    to = std::to_chars(shortest.data(), shortest.data() + shortest.size(), number.value).ptr;
  }
  if (from != to && *from == '+') ++from;
  Extended value = number.value;
  std::from_chars(from, to, value);
  return value;
}

Solution SolveForNPrecisely(const Subproblem& task, WantedN wanted, const Solution& rough) {
  // Without both ranges in force only a verdict is asked for, and there is no point (N, e) to try the others on.
  if (task.rows.size() <= kFew || !task.f_number_binds || !task.extension_binds) return SolveRows(task, wanted);
  Rows rows(task);
  Subproblem some = task;
  std::vector<LimitRow> chosen;
  if (rough.feasible) rows.Add(rough, chosen);
  for (;;) {
    some.rows = chosen;
    const Solution solved = SolveRows(some, wanted);
    if (!solved.feasible || !rows.Add(solved, chosen)) return solved;
  }
}

}  // namespace lensd::optics
