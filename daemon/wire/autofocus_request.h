// What the interface's autofocus methods ask for, as the rig's request.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "base/result.h"
#include "daemon/server/exchange.h"
#include "rig/rig.h"
#include "varlink/json.h"

namespace lensd::daemon {

/// From the parameters that all of them share: region or regions, policy, method, deadline, range and step.
/// InvalidArgument.
Result<rig::AutofocusRequest> AutofocusRequestOf(const varlink::Json& parameters);
/// The rig's answer to it, with its parameter as a path in the call.
Error AsAskedOfAutofocus(const Error& error, const varlink::Json& parameters);

class ServedLens;
using AutofocusAnswer = std::function<void(const rig::AutofocusOutcome&)>;
/// Has the lens search, and tells the call of its progress, if it wants to know, or why it could not be. `answer` is
/// called on the event loop's thread with how it ended, before watchers are told.
void RunAutofocus(ServedLens& lens, const ExchangePointer& exchange, rig::AutofocusRequest request,
                  AutofocusAnswer answer);
/// Keeps what was found for FocusAtAdd, where it was sure, learns from it, and looks after it from now on. Event loop
/// thread.
void NoteFocusFound(ServedLens& lens, const rig::AutofocusRequest& request, const rig::AutofocusOutcome& outcome);
/// The same of an answer after which the search goes on: no correction follows it, since the search holds focus itself.
void NoteFocusTracked(ServedLens& lens, const rig::AutofocusOutcome& outcome);
/// No client is left to be told of the autofocus whose end sets `ended` on the worker's thread: stops it, never the
/// motion of another client.
void StopUnlessEnded(ServedLens& lens, std::shared_ptr<const bool> ended, std::vector<drivers::Axis> axes);

}  // namespace lensd::daemon
