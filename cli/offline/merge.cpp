// lensctl merge: frames that were taken before into one sharp picture and a depth map.
#include <CLI/CLI.hpp>
#include <memory>

#include "cli/commands.h"
#include "cli/merge/merge_files.h"
#include "varlink/json.h"

namespace lensd::cli {
namespace {

struct MergeOptions {
  std::vector<std::string> frames;
  MergeText text;
};

Outcome RunMerge(const MergeOptions& options, Session& session) {
  if (options.text.picture.empty() && options.text.depth.empty()) {
    return Refuse(Exit::Usage, "say what to make: -o for the picture, --depth for the depth map, or both");
  }
  if (auto good = CheckMerge(options.text); !good) return PassOn(good);
  const auto merged = MergeFiles(session, options.frames, options.text);
  if (!merged) return PassOn(merged);
  session.json() ? session.PrintJson(*merged) : session.PrintText(MergedText(*merged));
  return Exit::Done;
}

}  // namespace

void AddMerge(CLI::App& root, Run& run) {
  auto options = std::make_shared<MergeOptions>();
  CLI::App* command =
      root.add_subcommand("merge", "merge a stack into one picture that is sharp everywhere, and a depth map");
  command->group(kOffline);
  command->add_option("FRAMES", options->frames, "a folder of PNG pictures, or PNG files")->required();
  command->add_option("-o", options->text.picture, "the sharp picture")->type_name("FILE");
  AddMergeOptions(*command, options->text);
  command->footer(
      "Frames of lensctl snapshot and lensctl stack contain the state of the lens. Other frames are used in the order "
      "of their names, and give no depth.");
  command->callback([options, &run] { run = [options](Session& session) { return RunMerge(*options, session); }; });
}

}  // namespace lensd::cli
