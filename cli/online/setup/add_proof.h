// Whether the lens of a new file works: lensd reads the file and opens the lens, and a picture is looked at.
#pragma once

#include <string>

#include "cli/link/daemon_client.h"
#include "cli/online/setup/lens_file.h"
#include "cli/terminal/session.h"
#include "varlink/json.h"

namespace lensd::cli {

/// Has lensd read the file and open the lens. The file is taken away again where that fails.
std::expected<void, Failure> StartAdded(DaemonClient& link, const Session& session, LensFile& file,
                                        const std::string& lens);

/// Prints what was added, with a picture's numbers. No: the camera sends no picture.
Outcome ReportAdded(Session& session, const LensFile& file, const std::string& lens, DaemonClient& link);

}  // namespace lensd::cli
