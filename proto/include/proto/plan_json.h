// Plans as JSON: what goes over the wire to the daemon, and what `lensctl plan --json` prints.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "base/result.h"
#include "base/units.h"
#include "optics/focus_scale.h"
#include "optics/planner.h"
#include "varlink/json.h"
#include "varlink/json_view.h"

namespace lensd::proto {

/// The request as type PlanRequest of io.lensd.Lens, every field present except those that are off. Lengths change
/// their unit in decimal, so that numbers of up to 15 digits arrive as the decimals they left as.
varlink::Json PlanRequestJson(const optics::PlanRequest& request);

/// Reads type PlanRequest; fields left out or null keep what `defaults` (the lens) says, limits excepted. Numbers are
/// the shortest decimals that read back to them. Code::InvalidArgument names the field that is wrong; whether the
/// request makes sense is optics::Plan's to say.
Result<optics::PlanRequest> PlanRequestFromJson(varlink::JsonView json, optics::PlanRequest defaults);

/// What is asked of a lens of the daemon, which alone knows what it is and how it stands.
struct LensRequest {
  struct Field {
    Metres width;
    Metres distance;  ///< on the scale of `from`
  };
  optics::PlanRequest plan;
  std::optional<optics::DistanceFrom> from{};                ///< where distances start; none: where the lens' own do
  std::optional<std::pair<Metres, Metres>> focal_lengths{};  ///< of a zoom; none: as it stands
  std::optional<Field> field{};                              ///< the focal length that frames this
  std::optional<Metres> sensor_width{};
  bool stack = false;
  /// What the request leaves to the lens, which may be other at another zoom.
  struct Own {
    bool extension_low = true, extension_high = true, sensor_tolerance = true, f_number_tolerance = true;
  };
  Own own{};
};

/// The same with what else PlanRequest says. Errors as PlanRequestFromJson().
Result<LensRequest> LensRequestFromJson(varlink::JsonView json, const optics::PlanRequest& defaults);

/// The answer to `request`, whose names its limits bear, with the fields of the contract: numbers that are not finite
/// become null. `principal_gap` is the lens's distance between its principal planes, for `focusFromSensorM`. `tStop` is
/// the working f-number of a lens that transmits everything. A feasible plan has no `conflict`, an infeasible one
/// nothing but `conflict` and `relax`, unless it is to show its setting all the same. The text is what goes out; it
/// takes a tenth of a varlink::Json's time.
enum class PlanShows { SettingOrConflict, Setting };
std::string PlanAnswerText(const optics::PlanRequest& request, const optics::PlanAnswer& answer,
                           Metres principal_gap = Metres{0.0}, PlanShows shows = PlanShows::SettingOrConflict);
/// The same as a varlink::Json.
varlink::Json PlanAnswerJson(const optics::PlanRequest& request, const optics::PlanAnswer& answer,
                             Metres principal_gap = Metres{0.0});

}  // namespace lensd::proto
