// What the interface's autofocus methods ask for, as the rig's request.
#pragma once

#include "base/result.h"
#include "proto/json.h"
#include "rig/rig.h"

namespace lensd::daemon {

/// From the parameters that all of them share: region or regions, policy and method. InvalidArgument.
Result<rig::AutofocusRequest> AutofocusRequestOf(const proto::Json& parameters);

}  // namespace lensd::daemon
