// The options of `plan`, and from them a question for the planner about a lens that they describe.
#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cli/charts/chart_file.h"
#include "cli/terminal/session.h"
#include "cli/text/quantity.h"
#include "optics/moving_limits.h"
#include "optics/planner.h"

namespace lensd::cli {

/// The options as written; empty: not given.
struct PlanText {
  std::string focal_length, f_number, aperture_diameter, extension, sensor_distance, focus;
  std::string sensor_tolerance, f_number_tolerance, wavelength, diffraction, pixel, pupil_factor;
  std::vector<std::string> sharp, blurred;
  std::string objective, blur_limit, model_tolerance;
  std::string field, sensor_width;
  std::string depth_map, mask;
  PlotText plot, rays;
  bool stack = false;
};

/// Adds the options above to a command.
void AddPlanOptions(CLI::App& command, PlanText& text);

/// A field to frame with a zoom, reported with the answer.
struct Framing {
  Metres sensor_width;
  Metres distance;  ///< from the lens centre
};

/// Which limits were asked for in pixels, and are answered so.
struct BlurUnits {
  std::optional<Metres> pixel;
  std::set<std::string, std::less<>> in_pixels;  ///< their names
};

/// A question to the planner, all depths from the lens centre.
struct PlanQuestion {
  optics::PlanRequest request;
  std::optional<Framing> framing;
  BlurUnits units = {};  ///< of the limits as they were typed
  /// The same as it was asked, where depths move with the sensor.
  std::optional<optics::MovingRequest> moving = {};
};

/// The answer, with what alone prevents it; a conflict holds wherever the sensor puts the depths. Errors as
/// optics::Plan().
Result<optics::PlanAnswer> AnswerTo(const PlanQuestion& question);

/// Reads the options. Distances of limits that start at the sensor depend on where the sensor will stand: with --focus
/// that is known, without it the question is solved again until the sensor stands where the distances assume it. For a
/// stack each distance is that of a subject in focus.
/// Errors: InvalidArgument, OutOfRange (one line naming the option), BadData and Io of depth maps.
Result<PlanQuestion> ReadPlan(const PlanText& text, std::optional<From> from);

}  // namespace lensd::cli
