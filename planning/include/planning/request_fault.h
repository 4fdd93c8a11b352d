// What is wrong with a Plan, told in the fields of the request as its caller wrote it.
#pragma once

#include <optional>

#include "base/result.h"
#include "planning/planning.h"
#include "proto/plan_json.h"
#include "varlink/json_view.h"

namespace lensd::daemon {

/// A range of apertures or extensions that ends before it begins; an end that the request leaves out is the lens' own.
/// InvalidArgument where both ends were given, else OutOfRange with what the lens has.
std::optional<Error> EmptyRange(const proto::LensRequest& asked, varlink::JsonView request,
                                const optics::PlanRequest& own);

/// The error with its parameter as a path in the call ("request.limits[0].limitPx"), where the planner and the reader
/// name fields of the request as the interface does.
Error AsAsked(const Error& error, varlink::JsonView request);

/// Of a focus out of reach, with what is in reach; any other error as it is.
Error WithReach(const Error& error, const proto::LensRequest& asked, const Planning& planning);

}  // namespace lensd::daemon
