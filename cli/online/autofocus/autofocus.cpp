// autofocus: with the lens' own camera, or with pictures that a command takes.
#include "cli/online/autofocus/autofocus.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "cli/link/arguments.h"
#include "cli/link/drive.h"
#include "cli/link/progress.h"
#include "cli/link/target.h"
#include "cli/online/autofocus/autofocus_plot.h"
#include "cli/online/autofocus/autofocus_record.h"
#include "cli/online/commands.h"
#include "cli/text/quantity.h"
#include "cli/text/texts.h"
#include "io/svg.h"

namespace lensd::cli {
namespace {

using varlink::Json;

Result<Json> ParseSearchRange(const std::string& text) {
  const std::size_t dots = text.find("..");
  if (dots == std::string::npos) {
    return Fail(Code::InvalidArgument,
                "--range '" + text +
                    "': two places with .. between them, such as 0.8m..2m, 0.5D..1.2D, @400..@900 or -50..+50");
  }
  auto from = ParseFocusTarget(text.substr(0, dots), "--range");
  if (!from) return from;
  auto to = ParseFocusTarget(text.substr(dots + 2), "--range");
  if (!to) return to;
  return Json{{"from", *std::move(from)}, {"to", *std::move(to)}};
}

Result<Json> ParseSearchStep(const std::string& text) {
  constexpr std::string_view kSteps = "steps";
  if (text.ends_with(kSteps)) {
    auto count = ParseNumber(std::string_view(text).substr(0, text.size() - kSteps.size()), "--step");
    if (!count) return PassOn(count);
    return Json{{"relative", *count->Nearest()}};
  }
  auto size = ParseBlur(text, "--step");
  if (!size) {
    return Fail(Code::InvalidArgument, "--step '" + text +
                                           "': a number of native steps such as 20steps, a length of extension such as "
                                           "8um, or a change of blur such as 5px; above 0");
  }
  if (size->in_pixels) return Json{{"blurPx", *size->value.Nearest()}};
  return Json{{"extensionUm", *size->value.Nearest() * 1e6}};
}

/// How long, where and how finely to search.
Result<void> AddSearch(const Session& session, const AutofocusOptions& options, Json& parameters) {
  if (auto limits = AddLimits(session, options.deadline, options.range, parameters); !limits) return limits;
  if (options.step.empty()) return {};
  auto step = ParseSearchStep(options.step);
  if (!step) return PassOn(step);
  parameters["step"] = *std::move(step);
  return {};
}

/// What both ways of autofocus have in common.
std::expected<Json, Failure> ParametersOf(const Session& session, const AutofocusOptions& options) {
  Json parameters{{"lens", LensOf(options.name)}};
  if (!options.method.empty()) parameters["method"] = options.method;
  if (!options.policy.empty()) parameters["policy"] = options.policy;
  Json regions = Json::array();
  for (const std::string& text : options.regions) {
    auto region = ParseRegion(text, "--roi");
    if (!region) return PassOn(region);
    regions.push_back(*std::move(region));
  }
  if (!regions.empty()) parameters["regions"] = std::move(regions);
  if (auto search = AddSearch(session, options, parameters); !search) return PassOn(search);
  if (!options.conditions.given()) return parameters;
  auto conditions = ConditionsOf(options.conditions);
  if (!conditions) return PassOn(conditions);
  parameters["conditions"] = *std::move(conditions);
  return parameters;
}

/// What does not go together.
std::optional<Failure> Contradiction(const AutofocusOptions& options) {
  if (options.frames_from.empty() && !options.pixel.empty()) {
    return Failure(Exit::Usage,
                   "--pixel describes the pictures of --frames-from; the pixel size of the lens' own camera is known");
  }
  if (options.frames_from.empty() && options.gamma) {
    return Failure(Exit::Usage,
                   "--gamma describes the pictures of --frames-from; the gamma of the lens' own camera is known");
  }
  if (options.track && !options.frames_from.empty()) {
    return Failure(Exit::Usage, "--track works with the lens' own camera, not with --frames-from");
  }
  if (options.conditions.given() && (options.track || !options.frames_from.empty())) {
    return Failure(Exit::Usage,
                   "--exposure, --gain, --f-number and --filter are of one search with the lens' own camera: not with "
                   "--track or --frames-from");
  }
  if (options.track && (options.plot.wanted() || !options.record.empty())) {
    return Failure(Exit::Usage, "--track continues after its answer, but --plot and --record are for one search");
  }
  if (auto good = CheckPlot(options.plot); !good) return good.error();
  return std::nullopt;
}

/// One search, recorded where that is asked for.
std::expected<Json, Failure> SearchOnce(Session& session, DaemonClient& link, Json parameters,
                                        const AutofocusOptions& options) {
  std::unique_ptr<Recording> recording;
  std::unique_ptr<ViewRecorder> recorder;
  if (!options.record.empty()) {
    auto made = Recording::Create(link, options.record, parameters);
    if (!made) return PassOn(made);
    recording = *std::move(made);
  }
  if (!options.frames_from.empty()) {
    auto result = FocusByCommand(session, link, std::move(parameters), options, recording.get());
    if (!result || !recording) return result;
    auto missing = recording->Finish(*result);
    if (!missing) return PassOn(missing);
    return result;
  }
  if (recording) {
    auto started = ViewRecorder::Start(session, *recording);
    if (!started) return PassOn(started);
    recorder = *std::move(started);
  }
  auto result = FocusByOwnCamera(session, link, std::move(parameters));
  if (!result || !recording) return result;
  constexpr Duration kPatience = std::chrono::seconds(20);  // for pictures that wait to be sent
  recording->Await(*result, kPatience);
  const auto trouble = recorder->trouble();
  recorder.reset();
  const auto missing = recording->Finish(*result);
  if (!missing) return PassOn(missing);
  if (*missing > 0) {
    session.Remark("--record: " + std::to_string(*missing) + " of the frames could not be kept" +
                   (trouble ? ": " + trouble->message : ": they came faster than they could be saved"));
  }
  return result;
}

Outcome Autofocus(Session& session, const AutofocusOptions& options) {
  auto parameters = ParametersOf(session, options);
  if (!parameters) return PassOn(parameters);
  if (auto wrong = Contradiction(options)) return std::unexpected(*std::move(wrong));
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  if (options.track) return TrackSubject(session, *link, *std::move(parameters));
  auto result = SearchOnce(session, *link, *std::move(parameters), options);
  if (!result) return PassOn(result);
  if (options.plot.wanted()) {
    if (auto drawn = WritePlot(options.plot, io::ChartSvg(AutofocusChart(*result))); !drawn) return PassOn(drawn);
  }
  session.json() ? session.PrintJson(*result) : session.PrintText(AutofocusText(*result));
  return result->value("focused", false) ? Exit::Done : Exit::No;
}

}  // namespace

Result<void> AddLimits(const Session& session, const std::string& deadline, const std::string& range,
                       Json& parameters) {
  if (!deadline.empty()) {
    auto parsed = ParseTime(deadline, "--deadline");
    if (!parsed) return PassOn(parsed);
    parameters["deadlineMs"] = std::chrono::duration<double, std::milli>(*parsed).count();
  }
  if (range.empty()) return {};
  auto parsed = ParseSearchRange(range);
  if (!parsed) return PassOn(parsed);
  parameters["range"] = *std::move(parsed);
  if (const auto& from = session.globals().from) {
    parameters["distanceFrom"] = kFromNames.at(static_cast<std::size_t>(*from));
  }
  return {};
}

std::expected<Json, Failure> FollowSearch(Session& session, DaemonClient& link, std::string_view method,
                                          Json parameters) {
  ProgressLine line(session);
  const Json lens = parameters["lens"];
  // A stop of the focus alone lets iris and filter go back to where they were.
  const Json axis = parameters.contains("conditions") ? Json("focus") : Json(nullptr);
  const auto show = [&](const Json& step) {
    if (step.contains("progress") && step["progress"].is_object()) line.Show(AutofocusProgressText(step["progress"]));
    return true;
  };
  return link.Follow(MethodOfLens(method), std::move(parameters), show, [&] {
    line.Clear();
    StopAndTell(session, lens, axis);
  });
}

std::expected<Json, Failure> FocusByOwnCamera(Session& session, DaemonClient& link, Json parameters) {
  auto reply = FollowSearch(session, link, "Autofocus", std::move(parameters));
  if (!reply) return PassOn(reply);
  return (*reply)["autofocus"];
}

Outcome TrackSubject(Session& session, DaemonClient& link, Json parameters) {
  parameters["track"] = true;
  ProgressLine line(session);
  int focused = 0, refused = 0;
  std::string stands;
  auto ended = link.Follow(MethodOfLens("Autofocus"), std::move(parameters), [&](const Json& step) {
    if (step.contains("progress") && step["progress"].is_object()) line.Show(AutofocusProgressText(step["progress"]));
    if (!step.contains("autofocus") || !step["autofocus"].is_object()) return true;
    line.Clear();
    const Json& result = step["autofocus"];
    ++(result.value("focused", false) ? focused : refused);
    stands = NumberText(result, "position", 8, "");
    session.json() ? session.PrintJson(result) : session.PrintText(AutofocusText(result));
    return true;
  });
  line.Clear();
  // The ways in which this is meant to end.
  constexpr Exit kEnds[] = {Exit::Interrupted, Exit::Timeout, Exit::Superseded, Exit::Stopped};
  if (!ended && std::ranges::find(kEnds, ended.error().status) == std::end(kEnds)) {
    return PassOn(ended);
  }
  std::string last = "tracking ended";
  if (!ended) last += " (" + ended.error().message + ")";
  last += ": focused " + std::to_string(focused) + (focused == 1 ? " time" : " times") + ", refused " +
          std::to_string(refused);
  if (!stands.empty()) last += "; the lens stays, last answer at position " + stands;
  session.Remark(last);
  return !ended && ended.error().status == Exit::Interrupted ? Exit::Interrupted : Exit::Done;
}

void AddAutofocus(CLI::App& root, Run& run) {
  auto options = std::make_shared<AutofocusOptions>();
  auto* command =
      root.add_subcommand("autofocus", "focus on a region of the picture; if that fails, go back and say why");
  command->group(kOnline);
  command->add_option("NAME", options->name, "lens");
  command
      ->add_option("--roi", options->regions,
                   "region as fractions of the frame; the camera's own or the centre when left out; may be repeated "
                   "for several regions")
      ->type_name("X,Y,W,H")
      ->expected(1)
      ->take_all();
  command->add_flag("--track", options->track,
                    "keep the region in focus until Control-C; its subject may move during the search");
  command
      ->add_option("--policy", options->policy,
                   "which of several regions to focus on: nearest (default), farthest or widest")
      ->check(CLI::IsMember({"nearest", "farthest", "widest"}))
      ->type_name("NAME");
  command->add_option("--method", options->method, "method; the daemon chooses when left out")->type_name("NAME");
  command
      ->add_option("--deadline", options->deadline,
                   "how long the search may take, such as 30s; when left out, as long as a search of the whole range")
      ->type_name("TIME");
  command
      ->add_option("--range", options->range,
                   "where to search: two targets of `focus`, such as 0.8m..2m, 0.5D..1.2D, @400..@900, or -50..+50 "
                   "steps from the present position")
      ->type_name("A..B");
  command
      ->add_option("--step", options->step,
                   "largest distance between the frames of the first pass, such as 20steps, 8um of extension or 5px of "
                   "blur; allows only methods that use steps")
      ->type_name("STEP");
  AddConditionOptions(*command, options->conditions);
  command
      ->add_option("--frames-from", options->frames_from,
                   "do not use the daemon's camera: for each frame run this shell command, which must save a new "
                   "picture as the PNG file $LENSD_FRAME")
      ->type_name("COMMAND");
  command
      ->add_option("--pixel", options->pixel,
                   "with --frames-from: pixel pitch of the pictures; without it only search methods work")
      ->type_name("LENGTH");
  command
      ->add_option("--gamma", options->gamma,
                   "with --frames-from: gamma of the pictures, sample = light^(1/G); 1 (linear light) when left out, "
                   "2.2 for most pictures made for a screen")
      ->check(CLI::Range(0.1, 10.0))
      ->type_name("G");
  AddPlotOptions(*command, options->plot, "the sharpness of every frame over focus, and the answer");
  command
      ->add_option("--record", options->record,
                   "save the frames and the configuration of the lens for `lens-bench autofocus --replay DIR`; DIR "
                   "must be empty or not exist")
      ->type_name("DIR");
  command->callback([&run, options] { run = [options](Session& session) { return Autofocus(session, *options); }; });
}

}  // namespace lensd::cli
