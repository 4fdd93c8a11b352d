// One sharp picture and a depth map of picture files.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "cli/terminal/session.h"

namespace CLI {
class App;
}

namespace lensd::cli {

/// What to make, as written; empty: not wanted.
struct MergeText {
  std::string picture, depth, prefer;
};

/// --depth and --prefer; what the picture's own option is called differs from command to command.
void AddMergeOptions(CLI::App& command, MergeText& text);

/// Before anything moves: Usage where a name does not end in .png, or nothing is to be made as --prefer says.
std::expected<void, Failure> CheckMerge(const MergeText& text);

/// Reads the frames of `paths` (as ReadShots() says), lays them over each other and writes what is wanted. Returns what
/// was found, for --json. BadData: frames of different sizes, a depth map (or the near one of two) of frames that do
/// not say where they were focused. CannotWrite.
std::expected<nlohmann::json, Failure> MergeFiles(Session& session, const std::vector<std::string>& paths,
                                                  const MergeText& text);

/// The same answer for people.
std::string MergedText(const nlohmann::json& merged);

}  // namespace lensd::cli
