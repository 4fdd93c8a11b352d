// What a scene needs: which method, model or renderer auto took, and what the heaviest would have cost.
#include <algorithm>
#include <cmath>

#include "bench/report/figures.h"

namespace lensd::bench {
namespace {

void AddAutofocusNeeds(const Evidence& rows, std::vector<Figure>& figures) {
  DotChart chart{.x = {.label = "frames until the answer (median)", .log = true}, .groups = {{.name = "", .rows = {}}}};
  int simple = 0, not_enough = 0, runs = 0;
  for (const EvidenceRow& frames : rows) {
    if (frames.family != "autofocus" || frames.method != "auto" || frames.measure != "frames" || !frames.sweep.empty())
      continue;
    const EvidenceRow* heaviest = RowOf(rows, "autofocus", frames.scene, "sweep", "frames");
    const EvidenceRow* within = RowOf(rows, "autofocus", frames.scene, "auto", "within");
    const EvidenceRow* wrong = RowOf(rows, "autofocus", frames.scene, "auto", "false");
    const EvidenceRow* fallback = RowOf(rows, "autofocus", frames.scene, "auto", "by the sweep");
    if (heaviest == nullptr || within == nullptr || wrong == nullptr) continue;
    if (frames.scene.starts_with("real")) continue;
    DotRow row{.name = frames.scene,
               .marks = {{frames.estimate, 0, "auto: " + InWords(frames)},
                         {heaviest->estimate, 1, "sweep: " + InWords(*heaviest)}},
               .figure = ""};
    if (fallback != nullptr) {
      row.figure = "sweep took over in " + Short(100 * fallback->estimate.middle) + " %";
      const EvidenceRow* alone = RowOf(rows, "autofocus", frames.scene, "defocus", "within");
      runs += frames.n;
      not_enough += static_cast<int>(std::lround(wrong->estimate.middle * wrong->n));
      // A sweep was needless at least as often as depth from defocus alone ends within more often than it was trusted.
      const double trusted = 1.0 - fallback->estimate.middle;
      if (alone != nullptr)
        simple += static_cast<int>(std::lround(std::max(0.0, alone->estimate.middle - trusted) * frames.n));
    }
    chart.groups[0].rows.push_back(std::move(row));
  }
  if (chart.groups[0].rows.empty()) return;
  std::string means =
      "Where depth from defocus answers, a handful of frames is enough; where it refuses, the sweep's are paid on top.";
  if (runs > 0) {
    means += " A simpler model would have done in " + ShareInWords(simple, runs) +
             " of the runs; what was chosen was not enough (false focus) in " + ShareInWords(not_enough, runs) +
             " (0 wanted).";
  }
  figures.push_back({.id = "need-autofocus",
                     .title = "Which autofocus each scene needs, and what the heaviest takes",
                     .read = "Left is faster; the disk is auto, the square the sweep alone, which every scene could be "
                             "given; lines are 95 % intervals.",
                     .means = means,
                     .chart = std::move(chart),
                     .key = {{0, "auto"}, {1, "sweep, the heaviest"}}});
}

/// Which camera model plans need, from trivial to hard.
void AddModelNeeds(const Evidence& rows, std::vector<Figure>& figures) {
  DotChart chart{.x = {.label = "time for one plan [us] (median of the problems)", .log = true},
                 .groups = {{.name = "", .rows = {}}}};
  int simpler = 0, beyond = 0, problems = 0;
  std::string most_at;
  double most = 0.0;
  for (const EvidenceRow& row : rows) {
    if (row.family != "plan" || row.measure != "time, chosen model") continue;
    const auto other = [&](const char* measure) { return RowOf(rows, "plan", row.scene, row.method, measure); };
    const EvidenceRow *heaviest = other("time, heaviest model"), *less = other("simpler would do"),
                      *short_of = other("not enough"), *error = other("model error"),
                      *tolerance = other("model tolerance");
    if (!heaviest || !less || !short_of || !error || !tolerance) continue;
    simpler += Counted({*less}).first;
    beyond += Counted({*short_of}).first;
    problems += less->n;
    if (less->estimate.middle > most) {
      most = less->estimate.middle;
      most_at = row.scene.substr(6);
    }
    chart.groups[0].rows.push_back(
        {.name = row.scene.substr(6),
         .marks = {{row.estimate, 0,
                    row.note + ": " + InWords(row) + "; off by " + Short(error->estimate.middle) + " um where " +
                        Short(tolerance->estimate.middle) + " um may be left out (medians)"},
                   {heaviest->estimate, 1, "calibrated, the heaviest: " + InWords(*heaviest)}},
         .figure = row.note});
  }
  if (problems == 0) return;
  figures.push_back(
      {.id = "need-model",
       .title = "Which camera model each plan needs, and what the heaviest costs",
       .read =
           "Plans from trivial to hard; at the right is how often each model was chosen: no blur (pinhole), the thin "
           "lens, with diffraction, with the lens' own pupils and calibration. The disk is a plan with only what the "
           "chosen model has, the square with all.",
       .means = "The next simpler model would have been within the tolerance in " + ShareInWords(simpler, problems) +
                " of the plans" +
                (most > 0.0 ? ", most often for " + most_at + " (" + Short(100 * most, 3) + " %)" : "") +
                "; what was chosen was off by more than it states or may be in " + ShareInWords(beyond, problems) +
                " (0 wanted). The truth is the fullest model, sampled.",
       .chart = std::move(chart),
       .key = {{0, "the chosen model"}, {1, "all that is known"}}});
}

}  // namespace

std::vector<Figure> NeedFigures(const Evidence& rows) {
  std::vector<Figure> figures = RenderNeeds(rows);
  AddModelNeeds(rows, figures);
  AddAutofocusNeeds(rows, figures);
  return figures;
}

}  // namespace lensd::bench
