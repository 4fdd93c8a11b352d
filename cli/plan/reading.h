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
#include "optics/moving_limits.h"
#include "optics/planner.h"

namespace lensd::cli {

/// A limit with its kind and its name settled.
struct NamedLimit {
  WrittenLimit written;
  std::string text = {};  ///< as typed
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
  std::vector<Decimal> blurs;  ///< of the limits, metres
  std::map<int, OccupiedDepths> classes;
  std::optional<Framing> framing;
  bool in_focus = false;  // distances of limits are those of subjects in focus
};

/// The limits of --sharp and --blurred, names settled: as given, or by their place among the options of their kind.
Result<std::vector<NamedLimit>> NamedLimits(const PlanText& text);

/// `limits`: as they were typed; one without a size is a pixel. All are told in lengths where the pixel is not known.
BlurUnits UnitsOf(const std::vector<NamedLimit>& limits, std::optional<Metres> pixel);

/// The depths of the classes that limits speak of; empty where none does.
Result<std::map<int, OccupiedDepths>> ReadClasses(const PlanText& text, const std::vector<NamedLimit>& limits);

/// `W@D`: a field W wide at distance D, metres.
struct FieldText {
  Decimal width;
  Decimal distance;
};
Result<FieldText> ParseField(std::string_view text, std::string_view option);

/// The planner's number for an exact decimal.
optics::Number NumberOf(const Decimal& exact);

/// The question with all depths from the lens centre, however they were measured.
Result<optics::PlanRequest> RequestFromCentre(const Reading& reading, const optics::FocusScale& scale);

/// The question as it was asked, for distances that start at the sensor; the focus from the lens centre.
Result<optics::MovingRequest> MeasuredFromSensor(const Reading& reading, const optics::FocusScale& scale);

}  // namespace lensd::cli
