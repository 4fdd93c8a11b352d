// preset save, recall, list, remove; undo.
#include <CLI/CLI.hpp>
#include <memory>

#include "cli/link/arguments.h"
#include "cli/link/daemon_client.h"
#include "cli/link/drive.h"
#include "cli/online/commands.h"
#include "cli/text/text.h"
#include "cli/text/texts.h"

namespace lensd::cli {
namespace {

using varlink::Json;

std::string PresetText(const Json& preset) {
  std::string line = preset.value("label", "") + ":";
  if (preset["vergenceD"].is_number()) {
    line += " focus " + DepthText({preset["vergenceD"].get<double>()});
    if (preset["vergenceBoundD"].is_number()) line += " within " + NumberText(preset, "vergenceBoundD", 2, " D");
    line += ",";
  }
  if (preset["focusPosition"].is_number()) line += " position " + NumberText(preset, "focusPosition", 8, ",");
  if (preset["fNumber"].is_number()) line += " f/" + NumberText(preset, "fNumber", 4, ",");
  if (preset["focalLengthMm"].is_number()) line += " " + NumberText(preset, "focalLengthMm", 5, " mm,");
  if (preset["filterPosition"].is_number()) line += " filter " + NumberText(preset, "filterPosition", 4, ",");
  if (preset["temperatureC"].is_number()) line += " " + NumberText(preset, "temperatureC", 4, " C,");
  return line + " " + preset.value("grade", "") + ", saved " + preset.value("saved", "");
}

/// Columns of the CSV export, in the interface's own names.
constexpr const char* kColumns[] = {"label",          "saved",        "focusPosition",  "irisPosition", "zoomPosition",
                                    "filterPosition", "vergenceD",    "vergenceBoundD", "focalPlaneM",  "fNumber",
                                    "focalLengthMm",  "temperatureC", "approachUp",     "grade"};

/// Labels hold neither commas nor quotes.
std::string CsvText(const Json& presets) {
  std::string text;
  for (const char* column : kColumns) text += (text.empty() ? "" : ",") + std::string(column);
  text += "\n";
  for (const Json& preset : presets) {
    std::string line;
    for (const char* column : kColumns) {
      if (column != kColumns[0]) line += ",";
      const Json& value = preset[column];
      if (value.is_string())
        line += value.get<std::string>();
      else if (!value.is_null())
        line += varlink::WriteJson(value);
    }
    text += line + "\n";
  }
  return text;
}

Outcome Save(Session& session, const std::vector<std::string>& words) {
  const NameAndValue given = SplitNameAndValue(words);
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  auto reply = link->Ask(MethodOfLens("PresetSave"), {{"lens", given.lens}, {"label", given.value}});
  if (!reply) return PassOn(reply);
  Json preset = (*reply)["preset"];
  const std::string note = TextOf(*reply, "note");
  if (!note.empty()) preset["note"] = note;
  session.json() ? session.PrintJson(preset)
                 : session.PrintText("saved " + PresetText(preset) + (note.empty() ? "" : "; " + note));
  return Exit::Done;
}

/// Of RecallResult and UndoResult, for people.
void ShowBroughtBack(Session& session, const Json& result, const std::string& what) {
  for (const Json& move : result["moves"]) session.PrintText(MoveText(move));
  std::string line = result.value("lens", "") + ": " + what;
  if (result["vergenceBoundD"].is_number())
    line += ", plane in focus within " + NumberText(result, "vergenceBoundD", 2, " D");
  if (result["positionBound"].is_number())
    line += ", position within " + NumberText(result, "positionBound", 3, " steps");
  const std::string note = TextOf(result, "note");
  session.PrintText(line + (note.empty() ? "" : "; " + note));
}

Outcome Recall(Session& session, const std::vector<std::string>& words) {
  const NameAndValue given = SplitNameAndValue(words);
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  auto reply = Drive(session, *link, MethodOfLens("PresetRecall"), {{"lens", given.lens}, {"label", given.value}});
  if (!reply) return PassOn(reply);
  const Json& recall = (*reply)["recall"];
  const bool reached = recall.value("reached", false);
  if (session.json()) {
    session.PrintJson(recall);
    return reached ? Exit::Done : Exit::No;
  }
  ShowBroughtBack(session, recall, (reached ? "recalled " : "NOT at ") + given.value);
  return reached ? Exit::Done : Exit::No;
}

Outcome Undo(Session& session, const std::string& name) {
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  auto reply = Drive(session, *link, MethodOfLens("Undo"), {{"lens", LensOf(name)}});
  if (!reply) return PassOn(reply);
  const Json& undo = (*reply)["undo"];
  const bool undone = undo.value("undone", false);
  if (session.json()) {
    session.PrintJson(undo);
  } else {
    ShowBroughtBack(session, undo, undone ? "back where it was" : "NOT brought back");
  }
  return undone ? Exit::Done : Exit::No;
}

Outcome List(Session& session, const std::string& name, bool csv) {
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  auto reply = link->Ask(MethodOfLens("PresetList"), {{"lens", LensOf(name)}});
  if (!reply) return PassOn(reply);
  const Json& presets = (*reply)["presets"];
  if (csv) {
    session.PrintText(CsvText(presets));
  } else if (session.json()) {
    session.PrintJson(presets);
  } else {
    for (const Json& preset : presets) session.PrintText(PresetText(preset));
    if (presets.empty()) session.PrintText("no preset is saved");
    if (const std::string note = TextOf(*reply, "note"); !note.empty()) session.Remark(note);
  }
  return Exit::Done;
}

Outcome Remove(Session& session, const std::vector<std::string>& words) {
  const NameAndValue given = SplitNameAndValue(words);
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  auto reply = link->Ask(MethodOfLens("PresetRemove"), {{"lens", given.lens}, {"label", given.value}});
  if (!reply) return PassOn(reply);
  session.json() ? session.PrintJson({{"removed", given.value}}) : session.PrintText("removed " + given.value);
  return Exit::Done;
}

using Act = Outcome (*)(Session&, const std::vector<std::string>&);

void AddVerb(CLI::App& preset, Run& run, const char* name, const char* about, Act act) {
  auto words = std::make_shared<std::vector<std::string>>();
  auto* command = preset.add_subcommand(name, about)->fallthrough();
  command->add_option("words", *words, "[NAME] LABEL")->expected(1, 2)->required()->type_name("");
  command->callback([&run, words, act] { run = [words, act](Session& session) { return act(session, *words); }; });
}

}  // namespace

void AddPreset(CLI::App& root, Run& run) {
  auto* preset = root.add_subcommand("preset", "save and recall the optical state of a lens")->group(kOnline);
  preset->require_subcommand(1)->fallthrough();
  AddVerb(*preset, run, "save", "save focus, iris, zoom and filter as they are, under a label", Save);
  AddVerb(*preset, run, "recall", "restore a saved optical state; the motor positions may differ", Recall);
  AddVerb(*preset, run, "remove", "forget a preset", Remove);
  struct Options {
    std::string name;
    bool csv = false;
  };
  auto options = std::make_shared<Options>();
  auto* list = preset->add_subcommand("list", "list the presets of a lens")->fallthrough();
  list->add_option("NAME", options->name, "lens");
  list->add_flag("--csv", options->csv, "print comma-separated values");
  list->callback(
      [&run, options] { run = [options](Session& session) { return List(session, options->name, options->csv); }; });
}

void AddUndo(CLI::App& root, Run& run) {
  auto name = std::make_shared<std::string>();
  auto* command = root.add_subcommand("undo",
                                      "return to the optical state before the last command that moved the lens, by any "
                                      "client; a second undo reverts the first");
  command->group(kOnline);
  command->add_option("NAME", *name, "lens");
  command->callback([&run, name] { run = [name](Session& session) { return Undo(session, *name); }; });
}

}  // namespace lensd::cli
