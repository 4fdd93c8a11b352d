// What the interface's autofocus methods ask for, as the rig's request.
#pragma once

#include <memory>
#include <vector>

#include "base/result.h"
#include "rig/rig.h"
#include "varlink/json.h"

namespace lensd::daemon {

/// From the parameters that all of them share: region or regions, policy, method, deadline, range and step.
/// InvalidArgument.
Result<rig::AutofocusRequest> AutofocusRequestOf(const varlink::Json& parameters);
/// The rig's answer to it, with its parameter as a path in the call.
Error AsAskedOfAutofocus(const Error& error, const varlink::Json& parameters);

class ServedLens;
/// No client is left to be told of the autofocus whose end sets `ended` on the worker's thread: stops it, never the
/// motion of another client.
void StopUnlessEnded(ServedLens& lens, std::shared_ptr<const bool> ended, std::vector<drivers::Axis> axes);

}  // namespace lensd::daemon
