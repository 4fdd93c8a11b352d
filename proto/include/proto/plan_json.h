// Plans as JSON: what goes over the wire to the daemon, and what `lensctl plan --json` prints.
#pragma once

#include <string>

#include "base/result.h"
#include "base/units.h"
#include "optics/planner.h"
#include "proto/document.h"
#include "proto/json.h"

namespace lensd::proto {

/// The request as type PlanRequest of io.lensd.Lens, every field present except those that are off. Lengths change
/// their unit in decimal, so that numbers of up to 15 digits arrive as the decimals they left as.
Json PlanRequestJson(const optics::PlanRequest& request);

/// Reads type PlanRequest; fields left out or null keep what `defaults` (the lens) says, limits excepted. Numbers are
/// the shortest decimals that read back to them. Code::InvalidArgument names the field that is wrong; whether the
/// request makes sense is optics::Plan's to say.
Result<optics::PlanRequest> PlanRequestFromJson(JsonView json, optics::PlanRequest defaults);

/// The answer with the fields of the contract: numbers that are not finite become null. `principal_gap` is the lens's
/// distance between its principal planes, for `focusFromSensorM`. `tStop` is the working f-number of a lens that
/// transmits everything. A feasible plan has no `conflict`, an infeasible one nothing but `conflict` and `relax`,
/// unless it is to show its setting all the same. The text is what goes out; it takes a tenth of a Json's time.
enum class PlanShows { SettingOrConflict, Setting };
std::string PlanAnswerText(const optics::PlanAnswer& answer, Metres principal_gap = Metres{0.0},
                           PlanShows shows = PlanShows::SettingOrConflict);
/// The same as a Json.
Json PlanAnswerJson(const optics::PlanAnswer& answer, Metres principal_gap = Metres{0.0});

}  // namespace lensd::proto
