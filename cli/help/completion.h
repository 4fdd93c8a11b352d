// What a shell may offer at a place of the command line.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace lensd::cli {

/// What may stand in the place of the last of `words`, which are those after "lensctl" and end with the one that is
/// being typed, empty where nothing of it is there yet. Lenses, presets and methods are asked of the daemon, for half a
/// second.
std::vector<std::string> Completions(const CLI::App& root, std::span<const std::string> words);

}  // namespace lensd::cli
