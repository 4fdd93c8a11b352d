// lensctl plan: which extension and f-number give this focal plane and these blur limits.

#include "cli/commands.h"

#include <CLI/CLI.hpp>
#include <memory>

#include "cli/online/plan/plan.h"
#include "cli/plan/plan_answer_text.h"
#include "cli/plan/options.h"
#include "cli/plan/plot.h"
#include "cli/plan/rays.h"
#include "cli/plan/stack_answer.h"
#include "cli/plan/stack_plot.h"
#include "cli/text/text.h"
#include "io/svg.h"
#include "optics/framing.h"
#include "optics/stack.h"
#include "proto/plan_json.h"

namespace lensd::cli {
namespace {

/// How wide a field the zoom frames with the sensor at `extension`.
Metres FramedWidth(const PlanQuestion& question, Metres extension) {
  const auto& [sensor_width, distance] = *question.framing;
  return optics::FieldWidth(Metres{question.request.focal_length.value}, extension, sensor_width, distance);
}

/// What the zoom was set to and what it frames, beside the plan or each shot; `extension`: none, there is no plan.
void AddFraming(const PlanQuestion& question, std::optional<Metres> extension, varlink::Json& json) {
  json["focalLengthMm"] = question.request.focal_length.value * 1e3;
  if (extension) json["fieldWidthM"] = FramedWidth(question, *extension).value;
}

std::string FramingText(const PlanQuestion& question, std::optional<Metres> extension) {
  std::string text = "focal length " + LengthText(Metres{question.request.focal_length.value});
  if (extension) {
    text += ", framing a field " + LengthText(FramedWidth(question, *extension)) + " wide at " +
            LengthText(question.framing->distance);
  }
  return text + "\n";
}

Outcome RunStack(const PlanQuestion& question, const PlotText& plot, Session& session) {
  const auto answer = optics::PlanStack(question.request);
  if (!answer) return PassOn(answer);
  varlink::Json json = StackJson(*answer);
  std::optional<Metres> first;
  if (!answer->shots.empty()) first = answer->shots.front().extension;
  if (question.framing) {
    AddFraming(question, first, json);
    for (std::size_t i = 0; i < answer->shots.size(); ++i) {
      AddFraming(question, answer->shots[i].extension, json["shots"][i]);
    }
  }
  if (plot.wanted() && answer->feasible) {
    const std::string lens = LengthText(Metres{question.request.focal_length.value});
    if (auto drawn = WritePlot(plot, io::ChartSvg(StackChart(json, lens))); !drawn) return PassOn(drawn);
  }
  const std::string framing = question.framing ? FramingText(question, first) : "";
  session.json() ? session.PrintJson(json) : session.PrintText(framing + StackText(json) + std::string(OriginLine()));
  return answer->feasible ? Exit::Done : Exit::No;
}

Outcome RunPlan(const PlanText& text, Session& session) {
  if (auto good = CheckPlanPlots(text); !good) return PassOn(good);
  const auto question = ReadPlan(text, session.globals().from);
  if (!question) return RefuseInput(question);
  if (text.stack) return RunStack(*question, text.plot, session);
  const auto answer = AnswerTo(*question);
  if (!answer) return PassOn(answer);
  if (text.plot.wanted()) {
    const std::string lens = LengthText(Metres{question->request.focal_length.value});
    if (auto drawn = WritePlot(text.plot, PlanPlot(question->request, *answer, lens)); !drawn) return PassOn(drawn);
  }
  if (text.rays.wanted()) {
    const auto rays = PlanRays(question->request, *answer, LengthText(Metres{question->request.focal_length.value}));
    if (auto drawn = WriteRays(text, rays); !drawn) return PassOn(drawn);
  }
  const auto extension = answer->feasible ? std::optional(answer->extension) : std::nullopt;
  if (session.json()) {
    varlink::Json json = proto::PlanAnswerJson(question->request, *answer);
    if (question->framing) AddFraming(*question, extension, json);
    session.PrintJson(json);
  } else {
    const std::string framing = question->framing ? FramingText(*question, extension) : "";
    session.PrintText(framing + PlanAnswerText(NamesOf(question->request), *answer, question->units));
  }
  return answer->feasible ? Exit::Done : Exit::No;
}

}  // namespace

void AddPlan(CLI::App& root, Run& run) {
  struct Options {
    PlanText text;
    std::string lens;
    bool apply = false;
  };
  auto options = std::make_shared<Options>();
  CLI::App* command =
      root.add_subcommand("plan", "f-number and focus that meet blur limits, or why none do")->group(kOffline);
  command->add_option("NAME", options->lens,
                      "a lens of the daemon; the daemon is also asked when there is no --focal-length");
  command->add_flag("--apply", options->apply, "move this lens to the planned setting and report what was reached");
  AddPlanOptions(*command, options->text);
  command->callback([options, &run] {
    run = [options](Session& session) {
      const bool online = options->apply || !options->lens.empty() || options->text.focal_length.empty();
      return online ? RunPlanOnline(options->text, options->lens, options->apply, session)
                    : RunPlan(options->text, session);
    };
  });
}

}  // namespace lensd::cli
