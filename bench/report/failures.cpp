// Where methods fail: how their runs end in every regime, and each difficulty swept until they do.
#include <algorithm>
#include <cmath>

#include "bench/report/figures.h"

namespace lensd::bench {
namespace {

/// Our methods first, auto before all.
std::vector<std::string> MethodsOf(const Evidence& rows) {
  std::vector<std::string> names = Names(rows, &EvidenceRow::method);
  const auto rank = [&](const std::string& name) {
    if (name == "auto") return 0;
    const auto row = std::ranges::find(rows, name, &EvidenceRow::method);
    return row->role == "ours" ? 1 : 2;
  };
  std::ranges::stable_sort(names, [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
  return names;
}

std::string WithoutFolder(const std::string& scene) {
  const std::size_t space = scene.find(' ');
  return scene.starts_with("score ") || scene.starts_with("regimes ") ? scene.substr(space + 1) : scene;
}

bool MustRefuse(const std::string& scene) {
  return scene == "regimes gradient" || scene == "real stacks, outside";
}

std::optional<Outcomes> OutcomesOf(const Evidence& rows, const std::string& scene, const std::string& method) {
  const auto count = [&](const char* how) -> int {
    const EvidenceRow* row = RowOf(rows, "autofocus", scene, method, how);
    return row != nullptr ? static_cast<int>(std::lround(row->estimate.middle * row->n)) : 0;
  };
  Outcomes outcomes{count("within"), count("off"), count("refused"), count("false"), MustRefuse(scene)};
  return outcomes.runs() > 0 ? std::optional(outcomes) : std::nullopt;
}

void AddOutcomes(const Evidence& rows, const std::string& id, const std::string& title,
                 const std::function<bool(const std::string&)>& in, std::vector<Figure>& figures) {
  const Evidence some = Selected(rows, [&](const EvidenceRow& row) {
    return row.family == "autofocus" && row.sweep.empty() && row.measure == "within" && in(row.scene);
  });
  if (some.empty()) return;
  OutcomeChart chart{.methods = MethodsOf(some), .regimes = {}};
  int wrong = 0, runs = 0;
  std::string worst;
  double least = 2.0;
  for (const std::string& scene : Names(some, &EvidenceRow::scene)) {
    std::vector<std::optional<Outcomes>> cells;
    for (const std::string& method : chart.methods) cells.push_back(OutcomesOf(rows, scene, method));
    if (cells.front() && chart.methods.front() == "auto") {
      const Outcomes& ours = *cells.front();
      wrong += ours.wrong;
      runs += ours.runs();
      const double right = static_cast<double>(ours.right_is_refusal ? ours.refused : ours.within) / ours.runs();
      if (right < least) {
        least = right;
        worst = WithoutFolder(scene);
      }
    }
    const auto counted = std::ranges::find_if(cells, [](const auto& cell) { return cell.has_value(); });
    const int each = counted != cells.end() ? (*counted)->runs() : 0;
    chart.regimes.emplace_back(WithoutFolder(scene) + ", n = " + std::to_string(each), std::move(cells));
  }
  figures.push_back(
      {.id = id,
       .title = title,
       .read =
           "Each bar is all runs of one method in one regime, so many as stand behind its name: within half a depth of "
           "field, off by more, refused, or, higher than the bar, claimed focus where there was none (false). The line "
           "below is the 95 % interval of what ended rightly; in gradient and outside that is refusing.",
       .means = runs == 0
                    ? "Auto was not run here."
                    : "Auto claims focus falsely in " + ShareInWords(wrong, runs) + " of its runs; " +
                          (least < 1.0 ? "its weakest is " + worst + " with " + Short(100 * least) + " % ended rightly."
                                       : "in none did any end wrongly."),
       .chart = std::move(chart)});
}

/// What runs that did not end within ended as, over all values.
std::string OtherEndsOf(const Evidence& rows, const std::string& scene, const std::string& method) {
  std::string text;
  for (const char* measure : {"off", "refused", "false"}) {
    const auto [hits, runs] = Counted(Selected(rows, [&](const EvidenceRow& row) {
      return row.scene == scene && row.method == method && row.measure == measure;
    }));
    if (hits > 0) text += (text.empty() ? "" : ", ") + std::to_string(hits) + " " + measure;
  }
  return text.empty() ? "" : " (" + text + ")";
}

/// The values at which a method's share is below nine in ten for certain.
std::string FailuresOf(const ChartLine& line, const std::vector<double>& values) {
  std::string text;
  for (std::size_t i = 0; i < std::min(line.marks.size(), values.size()); ++i) {
    if (line.marks[i].y_range && line.marks[i].y_range->high < 90.0)
      text += (text.empty() ? "" : ", ") + Short(values[i]);
  }
  return text.empty() ? "nowhere here" : "at " + text;
}

/// The first of a sweep's values is the easy one.
double EasyEndOf(const Evidence& rows) {
  return *rows.front().value;
}

/// A value that a logarithmic axis has no place for stands left of all others.
double OnLogAxis(double value, double least) {
  return value > 0.0 ? value : 0.3 * least;
}

void AddSweep(const Evidence& rows, const std::string& scene, std::vector<Figure>& figures) {
  const Evidence some =
      Selected(rows, [&](const EvidenceRow& row) { return row.scene == scene && !row.sweep.empty(); });
  std::vector<double> values;
  double least = 1e300;
  for (const EvidenceRow& row : some) {
    values.push_back(*row.value);
    if (*row.value > 0.0) least = std::min(least, *row.value);
  }
  std::ranges::sort(values);
  values.erase(std::unique(values.begin(), values.end()), values.end());
  ScatterChart chart{.x = {.label = some.front().sweep, .log = true},
                     .y = {.label = "runs within half a depth of field [%]", .low = 0.0, .high = 104.0},
                     .height = 240.0};
  for (const double value : values) chart.x.ticks.emplace_back(OnLogAxis(value, least), Short(value));
  // Methods that end alike stand beside each other rather than on each other.
  const double aside = std::pow(values.back() / least, 0.008);
  int series = 0, runs = 0;
  std::string edges;
  bool failed = false;
  for (const std::string& method : MethodsOf(some)) {
    ChartLine line{.marks = {}, .series = series, .label = method},
        lies{.marks = {}, .series = series, .label = method + ": false", .dashed = true};
    for (const double value : values) {
      const EvidenceRow* within = RowOf(some, "autofocus", scene, method, "within", value);
      const EvidenceRow* wrong = RowOf(some, "autofocus", scene, method, "false", value);
      if (within == nullptr || wrong == nullptr) continue;
      runs = within->n;
      const auto mark = [&](const EvidenceRow& row, int its) {
        const Estimate& e = row.estimate;
        return ChartMark{.x = OnLogAxis(value, least) * std::pow(aside, its - 1),
                         .y = 100 * e.middle,
                         .y_range = Estimate{100 * e.middle, 100 * e.low, 100 * e.high},
                         .series = its,
                         .tip = method + " at " + Short(value) + ", " + row.measure + ": " + InWords(row)};
      };
      line.marks.push_back(mark(*within, series));
      lies.marks.push_back(mark(*wrong, series));
    }
    failed = failed || !FailuresOf(line, values).starts_with("nowhere") || !OtherEndsOf(some, scene, method).empty();
    edges += (edges.empty() ? "" : "; ") + method + " " + FailuresOf(line, values) + OtherEndsOf(some, scene, method);
    const bool lied = std::ranges::any_of(lies.marks, [](const ChartMark& mark) { return mark.y > 0.0; });
    chart.lines.push_back(std::move(line));
    if (lied) chart.lines.push_back(std::move(lies));
    ++series;
  }
  figures.push_back(
      {.id = FileNameOf(scene),
       .title = "Until it fails: " + some.front().sweep.substr(0, some.front().sweep.find(" [")),
       .read = std::string(EasyEndOf(some) == values.front()  ? "Harder to the right"
                           : EasyEndOf(some) == values.back() ? "Harder to the left"
                                                              : "Harder to both sides of 1") +
               "; bars are 95 % Wilson intervals of " + std::to_string(runs) +
               " runs on one scene, dashed lines are false answers.",
       .means = failed ? "Certainly below nine runs in ten, and in brackets how all runs that were not within ended: " +
                             edges + "."
                       : "No method failed in this range.",
       .chart = std::move(chart)});
}

void AddFrequency(const Evidence& rows, std::vector<Figure>& figures) {
  const Evidence some = Selected(
      rows, [](const EvidenceRow& row) { return row.family == "move" && row.measure == "residual after 1 period"; });
  if (some.empty()) return;
  ScatterChart chart{.x = {.label = "error of the configured frequency [%]"},
                     .y = {.label = "what still swings after one period [% of the step]", .log = true},
                     .rules = {{.y = 5.0, .label = "5 %"}}};
  int series = 0;
  std::string within;
  for (const std::string& method : Names(some, &EvidenceRow::method)) {
    if (method == "fixed-wait") continue;  // a raw step, looked at later
    // As everywhere: what others do in the peers' colour.
    constexpr int kOurs[] = {0, 3, 4, 2, 5};
    const auto row_of = std::ranges::find(some, method, &EvidenceRow::method);
    ChartLine line{.marks = {}, .series = row_of->role == "ours" ? kOurs[series++ % 5] : 1, .label = method};
    double widest = 0.0;
    for (const EvidenceRow& row : some) {
      if (row.method != method) continue;
      line.marks.push_back(
          {.x = *row.value,
           .y = std::max(0.01, 100 * row.estimate.middle),
           .series = line.series,
           .tip = method + " at " + Short(*row.value) + " %: " + Short(100 * row.estimate.middle) + " % of the step"});
      if (row.estimate.middle <= 0.05) widest = std::max(widest, std::abs(*row.value));
    }
    within += (within.empty() ? "" : ", ") + method + (widest > 0.0 ? " up to " + Short(widest) + " %" : " never");
    chart.lines.push_back(std::move(line));
  }
  figures.push_back(
      {.id = "sweep-frequency",
       .title = "Until it fails: a ringing actuator whose frequency is not known well",
       .read =
           "Lower is calmer; 0 is a calibrated frequency. The runs are simulated and exact, so there is no interval.",
       .means = "Within 5 % after one period: " + within + ".",
       .chart = std::move(chart)});
}

void AddPlanner(const Evidence& rows, std::vector<Figure>& figures) {
  const Evidence some =
      Selected(rows, [](const EvidenceRow& row) { return row.family == "plan" && row.measure == "wrong"; });
  if (some.empty()) return;
  OutcomeChart chart{.methods = MethodsOf(some), .regimes = {}};
  std::erase(chart.methods, "exact rational reference");  // the judge
  int ours = 0, asked = 0;
  for (const std::string& set : Names(some, &EvidenceRow::scene)) {
    std::vector<std::optional<Outcomes>> cells;
    for (const std::string& method : chart.methods) {
      const EvidenceRow *wrong = RowOf(rows, "plan", set, method, "wrong"),
                        *over = RowOf(rows, "plan", set, method, "over");
      cells.emplace_back();
      if (wrong == nullptr || over == nullptr) continue;
      const auto count = [](const EvidenceRow& row) {
        return static_cast<int>(std::lround(row.estimate.middle * row.n));
      };
      const EvidenceRow* refused = RowOf(rows, "plan", set, method, "refused");
      Outcomes outcomes{
          .off = count(*over), .refused = refused != nullptr ? count(*refused) : 0, .wrong = count(*wrong)};
      outcomes.wrong -= outcomes.refused;
      outcomes.within = wrong->n - outcomes.off - outcomes.refused - outcomes.wrong;
      if (method == "lensd") {
        ours += outcomes.wrong + outcomes.refused;
        asked += wrong->n;
      }
      cells.back() = outcomes;
    }
    chart.regimes.emplace_back(set.starts_with("regime: ") ? set.substr(8) : set, std::move(cells));
  }
  figures.push_back(
      {.id = "plan-verdicts",
       .title = "Planning: how often each method is right",
       .read =
           "Each bar is all problems of one kind: the best f-number, within the limits but closed down more than "
           "needed, called impossible though it is not (refused), or limits broken or an answer where there is "
           "none (false); "
           "in the infeasible regime saying so is right; the line below is the 95 % interval of the first share. The "
           "judge "
           "takes each number as its shortest decimal, as lensd does; bisection counts in doubles and never promised "
           "that, so where a verdict hangs on the last digit this favours lensd.",
       .means = "lensd is wrong in " + ShareInWords(ours, asked) +
                " of the problems; the judge is exact rational arithmetic.",
       .chart = std::move(chart)});
}

}  // namespace

std::vector<Figure> FailureFigures(const Evidence& rows) {
  std::vector<Figure> figures;
  AddOutcomes(
      rows, "regimes", "Autofocus in the regimes where methods fail",
      [](const std::string& scene) { return scene.starts_with("regimes "); }, figures);
  AddOutcomes(
      rows, "scenes", "Autofocus on the scoring scenes: ordinary, dim, perturbed",
      [](const std::string& scene) { return scene.starts_with("score "); }, figures);
  AddOutcomes(
      rows, "stacks", "Autofocus on real focal stacks",
      [](const std::string& scene) { return scene.starts_with("real stacks"); }, figures);
  const Evidence swept = Selected(
      rows, [](const EvidenceRow& row) { return row.family == "autofocus" && row.scene.starts_with("sweep "); });
  for (const std::string& scene : Names(swept, &EvidenceRow::scene)) AddSweep(swept, scene, figures);
  AddFrequency(rows, figures);
  AddPlanner(rows, figures);
  for (Figure& figure : DriverFailures(rows)) figures.push_back(std::move(figure));
  for (Figure& figure : RenderFailures(rows)) figures.push_back(std::move(figure));
  return figures;
}

}  // namespace lensd::bench
