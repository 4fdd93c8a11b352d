// Calls that move a lens, as a person at a terminal meets them.
#pragma once

#include <string_view>

#include "cli/link/daemon_client.h"

namespace lensd::cli {

/// One call that moves `axis` of a lens (null: more than one), answered once. On a terminal a line says how far it has
/// come where that takes more than a second; Control-C and --timeout stop the axis and say where the lens stands.
std::expected<varlink::Json, Failure> Drive(Session& session, DaemonClient& link, std::string_view method,
                                            varlink::Json parameters, const varlink::Json& axis = nullptr);

/// Stops an axis (null: everything the lens does) on a connection of its own, because the call that is ended occupies
/// the other; then says where the lens stands, once it does.
void StopAndTell(Session& session, const varlink::Json& lens, const varlink::Json& axis);

}  // namespace lensd::cli
