// lensctl plan: which extension and f-number give this focal plane and these blur limits.

#include "cli/commands.h"

#include <CLI/CLI.hpp>
#include <memory>

#include "cli/online/plan.h"
#include "cli/plan/answer_text.h"
#include "cli/plan/options.h"
#include "cli/plan/plot.h"
#include "cli/plan/stack_answer.h"
#include "cli/text.h"
#include "io/svg.h"
#include "optics/framing.h"
#include "optics/stack.h"
#include "proto/plan_json.h"

namespace lensd::cli {
namespace {

/// What the zoom was set to and what it frames, beside the plan.
void AddFraming(const PlanQuestion& question, const optics::PlanAnswer& answer, proto::Json& json) {
  const Metres f{question.request.focal_length.value};
  json["focalLengthMm"] = f.value * 1e3;
  if (!answer.feasible) return;
  const auto& [sensor_width, distance] = *question.framing;
  json["fieldWidthM"] = optics::FieldWidth(f, answer.extension, sensor_width, distance).value;
}

std::string FramingText(const PlanQuestion& question, const optics::PlanAnswer& answer) {
  const Metres f{question.request.focal_length.value};
  std::string text = "focal length " + LengthText(f);
  if (answer.feasible) {
    const auto& [sensor_width, distance] = *question.framing;
    text += ", framing a field " + LengthText(optics::FieldWidth(f, answer.extension, sensor_width, distance)) +
            " wide at " + LengthText(distance);
  }
  return text + "\n";
}

Outcome RunStack(const PlanQuestion& question, Session& session) {
  const auto answer = optics::PlanStack(question.request);
  if (!answer) return Refuse(answer);
  if (session.json()) {
    session.PrintJson(StackJson(*answer));
  } else {
    session.PrintText(StackText(*answer));
  }
  return answer->feasible ? Exit::Done : Exit::No;
}

Outcome RunPlan(const PlanText& text, Session& session) {
  if (text.stack && !text.plot.empty())
    return Refuse(Exit::Usage, "--plot draws one plan; leave --stack or --plot out");
  const auto question = ReadPlan(text, PlanDefaults{}, session.globals().from);
  if (!question) return Refuse(question);
  if (text.stack) return RunStack(*question, session);
  const auto answer = optics::Plan(question->request);
  if (!answer) return Refuse(answer);
  if (!text.plot.empty()) {
    const auto written = io::WriteSvg(text.plot, PlanPlot(question->request, *answer));
    if (!written) return Refuse(written);
  }
  if (session.json()) {
    proto::Json json = proto::PlanAnswerJson(*answer, question->principal_gap);
    if (question->framing) AddFraming(*question, *answer, json);
    session.PrintJson(json);
  } else {
    const std::string framing = question->framing ? FramingText(*question, *answer) : "";
    session.PrintText(framing + PlanAnswerText(*answer, question->principal_gap));
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
  command->add_option("NAME", options->lens, "lens of the daemon; also asked when there is no --focal-length");
  command->add_flag("--apply", options->apply, "move that lens there and report what was reached");
  AddPlanOptions(*command, options->text);
  command->callback([options, &run] {
    run = [options](Session& session) {
      const bool online = options->apply || !options->lens.empty() || options->text.focal_length.empty();
      if (online && options->text.stack) {
        return Outcome(Refuse(Exit::Usage, "--stack plans for a lens described by --focal-length and its ranges"));
      }
      return online ? RunPlanOnline(options->text, options->lens, options->apply, session)
                    : RunPlan(options->text, session);
    };
  });
}

}  // namespace lensd::cli
