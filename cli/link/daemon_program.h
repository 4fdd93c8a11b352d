// Running lensd's own program, for what needs no daemon.
#pragma once

#include <string>
#include <vector>

namespace lensd::cli {

struct ProgramEnd {
  int status = -1;   ///< exit status; 127: there is no such program; -1: it did not end by itself, or not in time
  std::string said;  ///< on the stream that was asked for, without the last line break
};

/// Runs the lensd beside this program, else the one on the path, for a minute at most, and takes what it says on the
/// descriptor `stream` (STDOUT_FILENO or STDERR_FILENO); the other stream is this program's.
ProgramEnd RunDaemonProgram(std::vector<std::string> arguments, int stream);

}  // namespace lensd::cli
