// The exit statuses of lensctl. Which error ends with which is a column of proto/errors_and_methods.md.
#pragma once

#include <string_view>

#include "base/result.h"

namespace lensd::cli {

/// How lensctl ends. Up to 9 the daemon or a device said no; from 64 on as in sysexits.h.
enum class Exit : int {
  Done = 0,
  No = 1,             ///< the command worked and the answer is no
  Stopped = 2,        ///< a client stopped the axis
  Superseded = 3,     ///< a newer command for the same axis took over
  Busy = 4,           ///< something else is going on; the same command works later
  Timeout = 5,        ///< a deadline passed
  OutOfRange = 6,     ///< this lens does not reach that
  NotHomed = 7,       ///< the axis does not know where it stands
  Unsupported = 8,    ///< this lens or daemon cannot do that
  Leased = 9,         ///< another client has the lens to itself
  Usage = 64,         ///< the command line makes no sense as written
  BadData = 65,       ///< an input file says something wrong
  NoInput = 66,       ///< an input file is not there or cannot be read
  NotFound = 68,      ///< no such lens, preset or mark
  Unavailable = 69,   ///< the daemon or the device is not there
  Internal = 70,      ///< our own fault
  CannotWrite = 73,   ///< a file or stdout
  Io = 74,            ///< a device or a socket
  Protocol = 76,      ///< the other side broke the rules
  NotPermitted = 77,  ///< for instance a socket of another user
  Config = 78,        ///< a configuration is wrong
  Interrupted = 130,  ///< Control-C
};

/// What `--json` calls an exit status: "usage", "out-of-range".
std::string_view NameOf(Exit exit);

/// The exit status that an error of this code ends with.
Exit StatusOf(Code code);

}  // namespace lensd::cli
