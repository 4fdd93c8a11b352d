// One file of the state folder that belongs to a lens, written whole.
#pragma once

#include <functional>
#include <string>

#include "base/result.h"

namespace lensd::daemon {

class ServedLens;

/// Writes it by the thread for files, or removes it where `text` is empty; `what` it holds, for people. Event loop
/// thread, where `then` hears of it as well. NotKept: in force, and not on disk; the log says so, and it is tried again
/// when lensd ends.
void KeepStateFile(const ServedLens& lens, std::string file, std::string text, std::string what,
                   std::function<void(const Result<void>&)> then);
/// The time as these files have it.
std::string StateFileMoment();

}  // namespace lensd::daemon
