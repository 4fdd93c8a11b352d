// What the options of `plan` say, and its way to depths from the lens centre.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "base/result.h"
#include "cli/plan/depth_classes.h"
#include "cli/plan/options.h"
#include "cli/plan/where.h"
#include "optics/focus_scale.h"
#include "optics/planner.h"

namespace lensd::cli {

/// A limit with its kind and its name settled.
struct NamedLimit {
  WrittenLimit written;
  optics::LimitKind kind = optics::LimitKind::Sharp;
};

/// Whether only the gaps between the limit's occupied depths tell where the focal plane may be; else their ends do.
inline bool MayLieOnBothSides(const NamedLimit& limit) {
  return limit.kind == optics::LimitKind::Blurred && limit.written.side == optics::Side::Either;
}

/// Everything the options say, before distances are turned into depths from the lens centre.
struct Reading {
  optics::PlanRequest request;
  Decimal focal_length;
  std::optional<Decimal> pixel;
  std::optional<Depth> focus;
  std::vector<NamedLimit> limits;
  std::map<int, OccupiedDepths> classes;
  std::optional<Framing> framing;
  bool in_focus = false;  // distances of limits are those of subjects in focus
};

/// The planner's number for an exact decimal.
optics::Number NumberOf(const Decimal& exact);

/// The question with all depths from the lens centre, however they were measured.
Result<optics::PlanRequest> RequestFromCentre(const Reading& reading, const optics::FocusScale& scale);

}  // namespace lensd::cli
