// What alone keeps a lens from a plan.
#pragma once

#include <stop_token>
#include <string>
#include <vector>

#include "planning/planning.h"

namespace lensd::daemon {

/// How to learn the backlash of an axis of this lens: "lensctl backlash gige".
std::string BacklashAdvice(const std::string& lens, drivers::Axis axis);

/// A plan that PlanFor() refused.
struct RefusedPlan {
  const Planning& planning;
  const proto::LensRequest& asked;
  const rig::Status& now;
  const rig::RigConfig& config;
  const optics::PositionPlan& answer;
  const std::string& lens;  ///< its name, for advice such as "lensctl backlash gige"
};

/// Everything of the lens and of the request, limits excepted, without which alone there would be a plan: what is not
/// known of its motors and its calibration, its steps, its apertures, its travel, where its zoom stands; and what
/// optics::CausesInRequest() names. On any thread. It takes as long as some twenty plans, and for a lens that zooms as
/// one with a free focal length; `stop` ends it early, with what was found by then.
std::vector<optics::PlanCause> CausesOf(const RefusedPlan& refused, const std::stop_token& stop);

}  // namespace lensd::daemon
