// focus-map: best focus all over the frame, by the lens' own camera.
#include <CLI/CLI.hpp>
#include <charconv>
#include <memory>

#include "cli/charts/chart_file.h"
#include "cli/link/arguments.h"
#include "cli/online/autofocus/autofocus.h"
#include "cli/online/autofocus/focus_map_compare.h"
#include "cli/online/autofocus/focus_map_plot.h"
#include "cli/online/autofocus/focus_map_text.h"
#include "cli/online/commands.h"
#include "cli/text/quantity.h"

namespace lensd::cli {
namespace {

using varlink::Json;

struct FocusMapOptions {
  std::string name;
  std::string grid;  ///< these as written; empty: the daemon's
  std::string range;
  std::string deadline;
  std::string mount;
  std::string before;  ///< a file
  std::string moved;
  bool turned = false;
  PlotText plot;
};

/// `CxR` to columns and rows.
Result<void> AddGrid(const std::string& text, Json& parameters) {
  if (text.empty()) return {};
  const char* const end = text.data() + text.size();
  int columns = 0, rows = 0;
  const auto first = std::from_chars(text.data(), end, columns);
  if (first.ec == std::errc() && first.ptr != end && *first.ptr == 'x') {
    const auto second = std::from_chars(first.ptr + 1, end, rows);
    if (second.ec == std::errc() && second.ptr == end) {
      parameters["columns"] = columns;
      parameters["rows"] = rows;
      return {};
    }
  }
  return Wrong("--grid", text, "columns and rows of the frame with an x between them, such as 5x4");
}

/// An earlier map, and what has been done since.
struct Change {
  Json before;
  std::optional<Metres> moved;  ///< nothing: the target was turned
};

/// Nothing: this map stands alone.
std::expected<std::optional<Change>, Failure> ChangeOf(const FocusMapOptions& options) {
  if (options.before.empty() && options.moved.empty() && !options.turned) return std::nullopt;
  if (options.before.empty() || options.moved.empty() != options.turned) {
    return Refuse(
        Exit::Usage,
        "--before FILE is an earlier map, and either --moved LENGTH or --turned says what has been done since");
  }
  Change change;
  if (!options.moved.empty()) {
    auto length = ParseExactLength(options.moved, "--moved");
    if (!length) return PassOn(length);
    change.moved = Metres{*length->Nearest()};
    if (change.moved->value == 0.0) return Refuse(Exit::Usage, "--moved: a length that is not 0");
  }
  auto before = ReadFocusMap(options.before);
  if (!before) return PassOn(before);
  change.before = *std::move(before);
  return change;
}

/// The map with what the change says, for programs and for people.
void Print(Session& session, Json map, const std::optional<Change>& change, std::optional<Metres> between_shims) {
  std::string text = FocusMapText(map, between_shims);
  if (change && map.value("mapped", false)) {
    if (change->moved) {
      map["probe"] = ProbeOf(change->before, map, *change->moved);
      text += "\n" + ProbeText(map["probe"]);
    } else {
      map["turned"] = TurnedOf(change->before, map);
      text += "\n" + TurnedText(map["turned"]);
    }
  }
  session.json() ? session.PrintJson(map) : session.PrintText(text);
}

Outcome FocusMap(Session& session, const FocusMapOptions& options) {
  Json parameters{{"lens", LensOf(options.name)}};
  if (auto grid = AddGrid(options.grid, parameters); !grid) return PassOn(grid);
  if (auto limits = AddLimits(session, options.deadline, options.range, parameters); !limits) return PassOn(limits);
  std::optional<Metres> between_shims;
  if (!options.mount.empty()) {
    auto length = ParsePositiveLength(options.mount, "--mount");
    if (!length) return PassOn(length);
    between_shims = Metres{*length->Nearest()};
  }
  if (auto good = CheckPlot(options.plot); !good) return PassOn(good);
  auto change = ChangeOf(options);
  if (!change) return PassOn(change);
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  auto reply = FollowSearch(session, *link, "FocusMap", std::move(parameters));
  if (!reply) return PassOn(reply);
  const Json& map = (*reply)["map"];
  if (options.plot.wanted()) {
    if (auto drawn = WritePlot(options.plot, io::ChartSvg(FocusMapChart(map))); !drawn) return PassOn(drawn);
  }
  Print(session, map, *change, between_shims);
  return map.value("mapped", false) ? Exit::Done : Exit::No;
}

}  // namespace

void AddFocusMap(CLI::App& root, Run& run) {
  auto options = std::make_shared<FocusMapOptions>();
  auto* command = root.add_subcommand("focus-map",
                                      "find the best focus all over the frame: tilt, curvature, and what to shim or "
                                      "turn; if that fails, go back and say why");
  command->group(kOnline);
  command->add_option("NAME", options->name, "lens");
  command->add_option("--grid", options->grid, "columns and rows of regions, from 2x2 to 12x12; 5x4 when left out")
      ->type_name("CxR");
  command
      ->add_option("--range", options->range,
                   "where to search: two targets of `focus`, such as 0.8m..2m, 0.5D..1.2D or @400..@900")
      ->type_name("A..B");
  command
      ->add_option("--deadline", options->deadline,
                   "how long the search may take, such as 30s; when left out, as long as a search of the whole range")
      ->type_name("TIME");
  command
      ->add_option("--mount", options->mount,
                   "distance between shims at the lens' mount, for which their thickness is computed")
      ->type_name("LENGTH");
  command
      ->add_option("--before", options->before,
                   "an earlier map that --json printed, to show the effect of an adjustment since then")
      ->type_name("FILE");
  command
      ->add_option("--moved", options->moved,
                   "with --before: a spacer, a corrector or the back focus was changed by this; the answer says how "
                   "much curvature that removed, and how far to go on")
      ->type_name("LENGTH");
  command->add_flag("--turned", options->turned,
                    "with --before: the target was turned by half a turn in its own plane, to separate its tilt from "
                    "that of the lens");
  AddPlotOptions(*command, options->plot, "best focus of each region");
  command->callback([&run, options] { run = [options](Session& session) { return FocusMap(session, *options); }; });
}

}  // namespace lensd::cli
