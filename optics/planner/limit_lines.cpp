// Most programmes are all vergences outside the focal length: first their numbers are gathered, each kind in its place,
// then each column is worked out in one loop without a choice in it.
#include "planner/limit_lines.h"

namespace lensd::optics::task_detail {

namespace {

/// Lines that stand in a row, vergences in p and limits in q, become lines of one kind; false where one is not plain.
bool MakeLines(const LensNumbers<double>& lens, std::span<double> p, std::span<double> q, RowKind kind) {
  const bool sharp = kind == RowKind::SharpFar || kind == RowKind::SharpNear;
  const double inwards = kind == RowKind::SharpFar || kind == RowKind::Front ? -lens.delta : lens.delta;
  const double widen = sharp ? lens.narrow : lens.widen;
  const double sign = kind == RowKind::SharpFar || kind == RowKind::Behind ? 1.0 : -1.0;
  const double own = lens.liquid ? 0.0 : lens.f, f = lens.f, skew = lens.skew;
  constexpr double kNear = 1e-14;
  double least = 1.0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const double u = p[i], w = 1 - own * u, v = f * f * u, reach = sign * (q[i] * widen * (1 + skew * u));
    p[i] = v / w + inwards;
    q[i] = reach / w;
    const double room = w * f - kNear * v;
    least = room < least ? room : least;
  }
  return least > 0.0;
}

}  // namespace

bool WritePlainLines(LinearProgram<double>& programme, std::span<const LimitRow> rows,
                     const std::array<std::size_t, 4>& of_kind) {
  const auto [far, near, behind, front] = of_kind;
  struct Column {
    double *p, *q;
    int* name;
  };
  const Column above{programme.upper_p.data(), programme.upper_q.data(), programme.upper_name.data()};
  const Column below{programme.lower_p.data(), programme.lower_q.data(), programme.lower_name.data()};
  const auto from = [](const Column& column, std::size_t i) {
    return Column{column.p + i, column.q + i, column.name + i};
  };
  std::array<Column, 4> next{above, below, from(below, near), from(above, far)};
  bool plain = true;
  for (const LimitRow& row : rows) {
    Column& column = next[static_cast<std::size_t>(row.kind)];
    plain &= row.depth->is_vergence;
    *column.p++ = row.depth->number.value;
    *column.q++ = row.limit->value;
    *column.name++ = row.name;
  }
  const auto make = [&](const Column& column, std::size_t i, std::size_t count, RowKind kind) {
    return MakeLines(programme.lens, {column.p + i, count}, {column.q + i, count}, kind);
  };
  programme.upper_sharp = far, programme.lower_sharp = near;
  return plain && make(above, 0, far, RowKind::SharpFar) && make(below, 0, near, RowKind::SharpNear) &&
         make(below, near, behind, RowKind::Behind) && make(above, far, front, RowKind::Front);
}

}  // namespace lensd::optics::task_detail
