// Which lens of the daemon is meant.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/link/daemon_client.h"

namespace lensd::cli {

/// LensInfo of the lens of that name, or of the only one where the name is empty.
std::expected<varlink::Json, Failure> FindInfo(DaemonClient& link, const std::string& lens);
/// LensStatus of the lens, once its device has been opened or has failed to open; after `at_most` as it then is.
std::expected<varlink::Json, Failure> StatusOnceOpened(DaemonClient& link, const std::string& lens, Duration at_most);
/// As FindInfo, and of a lens whose device is being opened once that has worked or failed, or after some seconds.
std::expected<varlink::Json, Failure> FindInfoOnceOpened(DaemonClient& link, const std::string& lens);
/// What Reload has answered, and the lenses that are not open after it.
struct Reloaded {
  varlink::Json reply;
  std::vector<std::string> absent;  ///< one sentence each: "NAME is not open: WHY"
};
/// Asks the daemon to read its configuration again, then waits, 15 s at most, until every lens that it opens is open or
/// has failed to open.
std::expected<Reloaded, Failure> ReloadAndOpen(DaemonClient& link);
/// Whether the daemon has a lens of this name; false where it is not there.
bool IsLens(const Session& session, const std::string& name);

/// Why lensd did not read the configuration again: what is wrong with the file, or with the caller.
std::string RefusedReload(const Failure& failure);

/// What is missing or contradicts itself in the configuration of an open lens whose optics are known, and what to do.
struct LensRemark {
  std::string what, remedy;
};
std::vector<LensRemark> RemarksOn(const varlink::Json& info);

/// Why nothing can be planned for it: its optics were not configured. Nothing of a lens that has not been open yet,
/// whose optics lensd does not say: its methods refuse it with the reason.
std::optional<Failure> NothingToPlan(const varlink::Json& info);

/// Why the f-number or the focal length of a lens whose optics are known is not: `what` ("there is no ..."), then the
/// axes whose position is not known, and what to do. Nothing where every axis knows its position. NotHomed.
std::optional<Failure> WhereUnknown(const varlink::Json& info, const varlink::Json& status, const std::string& what);

}  // namespace lensd::cli
