// `lensctl setup --save`: what was measured, into the file that `lensctl add` wrote for this lens.
#pragma once

#include <string>

#include "cli/link/daemon_client.h"
#include "cli/online/setup/setup_text.h"

namespace lensd::cli {

/// The text with `key = value` in the table [lens.AXIS] of its only lens: in place of the line of this key, else below
/// the head of the table, else in a new table at the end. Every other line stays as it is.
std::string WithAxisKey(const std::string& text, const std::string& axis, const std::string& key,
                        const std::string& value);

/// The lens' own file in the folder of drop-ins. Config: this lensd reads no file; NotFound: the lens has no file of
/// its own there, or shares it. CannotWrite, NotPermitted: this user may not change it. Changes nothing.
std::expected<std::string, Failure> OwnFileOf(DaemonClient& link, const std::string& lens);

/// Writes speeds and backlash into the file, has lensd read it, and waits until the lens is open again or has failed to
/// open. Returns the line to print: what was saved, or that nothing was. The file is as before where lensd refuses it.
std::expected<std::string, Failure> SaveSetup(DaemonClient& link, const std::string& file, const SetupFindings& found);

}  // namespace lensd::cli
