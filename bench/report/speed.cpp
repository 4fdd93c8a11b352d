// Speed against accuracy, family by family.
#include <algorithm>
#include <cmath>
#include <set>

#include "bench/report/figures.h"

namespace lensd::bench {
namespace {

constexpr double kLeastError = 1e-16;  // where an error of nothing is drawn

constexpr std::string_view kUnsure = " ?";  // behind a figure whose spread is too wide to judge

const ChartKey kOursAndPeers = {{0, "lensd"}, {1, "peers"}};

std::string ListOf(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0) text += i + 1 == names.size() ? " and " : ", ";
    text += names[i];
  }
  return text.empty() ? "nothing" : text;
}

std::vector<std::string> LabelsOf(const ChartLine& front) {
  std::vector<std::string> labels;
  labels.reserve(front.marks.size());
  for (const ChartMark& mark : front.marks) {
    labels.push_back(mark.label.ends_with(kUnsure) ? mark.label.substr(0, mark.label.size() - kUnsure.size())
                                                   : mark.label);
  }
  return labels;
}

bool Scoring(const EvidenceRow& row) {
  return row.family == "autofocus" && row.scene.starts_with("score ");
}

/// The rows of scoring scenes that have `measure`: the same runs on both axes.
Evidence ScoringWith(const Evidence& rows, const std::string& measure) {
  const std::vector<std::string> scenes =
      Names(Selected(rows, [&](const EvidenceRow& row) { return Scoring(row) && row.measure == measure; }),
            &EvidenceRow::scene);
  return Selected(rows, [&](const EvidenceRow& row) {
    return Scoring(row) && std::ranges::find(scenes, row.scene) != scenes.end();
  });
}

/// Frames (or time, with that of computing) against the blur that is left, over all scoring scenes.
void AddAutofocus(const Evidence& rows, const std::string& measure, std::vector<Figure>& figures) {
  const Evidence scoring = ScoringWith(rows, measure);
  if (scoring.empty()) return;
  const bool frames = measure == "frames";
  ScatterChart chart{.x = {.label = frames ? "frames until the answer (median)"
                                           : "time until the answer, computing included [ms] (median)",
                           .log = true},
                     .y = {.label = "blur left when it says focused [px] (median of its diameter)", .log = true}};
  int most = 0;
  for (const std::string& method : Names(scoring, &EvidenceRow::method)) {
    const auto of = [&](const std::string& wanted) {
      return Selected(scoring, [&](const EvidenceRow& row) { return row.method == method && row.measure == wanted; });
    };
    const Evidence cost = of(measure), left = of("error");
    if (cost.empty() || left.empty()) continue;
    int runs = 0;
    const Estimate x = Pooled(cost, &runs), y = Pooled(left);
    const auto [within, all] = Counted(of("within"));
    most = std::max(most, runs);
    chart.marks.push_back({.x = x.middle,
                           .y = y.middle,
                           .x_range = x,
                           .y_range = y,
                           .series = SeriesOf(cost.front()),
                           .label = method,
                           .tip = method + ": " + Short(x.middle) + (frames ? " frames, " : " ms, ") + Short(y.middle) +
                                  " px left, n = " + std::to_string(runs) + "; within half a depth of field " +
                                  ShareInWords(within, all)});
  }
  if (chart.marks.empty()) return;
  const Evidence floors = Selected(
      scoring, [](const EvidenceRow& row) { return row.method == "auto" && row.measure == "floor of the error"; });
  if (!floors.empty()) chart.rules.push_back({.y = Pooled(floors).middle, .label = "floor: light and one step"});
  const Evidence known = Selected(
      scoring, [](const EvidenceRow& row) { return row.method == "auto" && row.measure == "floor of the time"; });
  if (frames) {
    chart.rules.push_back({.x = 2.0, .label = "two frames"});
  } else if (!known.empty()) {
    chart.rules.push_back({.x = Pooled(known).middle, .label = "floor: who knew the answer"});
  }
  const ChartLine front = FrontOf(chart.marks);
  chart.lines.push_back(front);
  const auto scenes = Names(scoring, &EvidenceRow::scene).size();
  figures.push_back(
      {.id = frames ? "autofocus-frames" : "autofocus-time",
       .title = frames ? "Autofocus: how many frames each method takes, and how sharp it ends"
                       : "Autofocus: how long each method takes, and how sharp it ends",
       .read = "Left is faster, down is sharper; a mark is a method over " + std::to_string(scenes) +
               " scenes (n up to " + std::to_string(most) +
               "), its lines are 95 % intervals of the medians; nothing lies left of and below the stepped line. The "
               "floor is the Cramér–Rao bound of auto's own frames with the motor's step" +
               (frames ? "." : "; that of time is the move to the answer, its settling and two frames."),
       .means = "On the front are " + ListOf(LabelsOf(front)) + ".",
       .chart = std::move(chart),
       .key = kOursAndPeers});
}

/// Shares that end within half a depth of field.
void AddWithin(const Evidence& rows, std::vector<Figure>& figures) {
  DotChart chart{.x = {.label = "runs that end within half a depth of field [%]", .low = 0.0, .high = 100.0},
                 .groups = {}};
  const auto add = [&](const std::string& name, const std::function<bool(const EvidenceRow&)>& in) {
    DotGroup group{.name = name, .rows = {}};
    const Evidence some = Selected(rows, [&](const EvidenceRow& row) {
      return row.family == "autofocus" && row.sweep.empty() && row.measure == "within" && in(row);
    });
    for (const std::string& method : Names(some, &EvidenceRow::method)) {
      const Evidence its = Selected(some, [&](const EvidenceRow& row) { return row.method == method; });
      const auto [hits, runs] = Counted(its);
      const Estimate share = ShareOf(hits, runs);
      group.rows.push_back({.name = method,
                            .marks = {{{100 * share.middle, 100 * share.low, 100 * share.high},
                                       SeriesOf(its.front()),
                                       method + ": " + ShareInWords(hits, runs)}},
                            .figure = Short(100 * share.middle, 3) + " %, n = " + std::to_string(runs)});
    }
    std::ranges::stable_sort(group.rows, [](const DotRow& a, const DotRow& b) {
      return a.marks[0].estimate.middle > b.marks[0].estimate.middle;
    });
    if (!group.rows.empty()) chart.groups.push_back(std::move(group));
  };
  const auto dim = [](const EvidenceRow& row) {
    return row.scene.ends_with("-dim") || row.scene.ends_with("low-light");
  };
  add("Ordinary simulated scenes", [&](const auto& row) { return row.scene.starts_with("score ") && !dim(row); });
  add("Low light", dim);
  add("Real focal stacks, one depth", [](const auto& row) { return row.scene == "real stacks, one depth"; });
  if (chart.groups.empty()) return;
  std::string means = "Best of each group: ";
  for (const DotGroup& group : chart.groups) {
    means += (&group == &chart.groups.front() ? "" : "; ") + group.name + ": " + group.rows.front().name + " with " +
             group.rows.front().figure;
  }
  figures.push_back({.id = "autofocus-within",
                     .title = "Autofocus: how often each method ends in focus",
                     .read = "Right is better; a mark is a share of all runs, refusals counted as misses, its line the "
                             "95 % Wilson interval.",
                     .means = means + ".",
                     .chart = std::move(chart),
                     .key = kOursAndPeers});
}

/// How often what is told as an interval holds, against how often it is said to.
void AddClaims(const Evidence& rows, std::vector<Figure>& figures) {
  ScatterChart chart{.x = {.label = "how often the interval is said to hold the truth [%]", .low = 45.0, .high = 100.0},
                     .y = {.label = "how often it does [%]", .low = 45.0, .high = 100.0},
                     .diagonal = true};
  std::string means;
  int most = 0, series = 0;
  const auto add = [&](const std::string& name, const std::string& method, const auto& in) {
    ChartLine line{.marks = {}, .series = series, .label = name};
    for (const int percent : {50, 80, 90, 95, 99}) {
      const auto [held, claims] = Counted(Selected(rows, [&](const EvidenceRow& row) {
        return row.family == "autofocus" && row.method == method && in(row) &&
               row.measure == "claim of " + std::to_string(percent) + " % holds";
      }));
      if (claims == 0) continue;
      const Estimate share = ShareOf(held, claims);
      most = std::max(most, claims);
      line.marks.push_back({.x = static_cast<double>(percent),
                            .y = 100 * share.middle,
                            .y_range = Estimate{100 * share.middle, 100 * share.low, 100 * share.high},
                            .series = series,
                            .tip = name + ": said to hold in " + std::to_string(percent) + " %, holds in " +
                                   ShareInWords(held, claims)});
      if (percent == 95) means += (means.empty() ? "" : ", ") + name + " " + ShareInWords(held, claims);
    }
    series = series == 0 ? 3 : 4;  // not the colour of peers
    if (!line.marks.empty()) chart.lines.push_back(std::move(line));
  };
  add("ordinary scenes", "auto", [](const EvidenceRow& row) { return Scoring(row) && !row.scene.ends_with("-dim"); });
  add("low light", "auto", [](const EvidenceRow& row) { return Scoring(row) && row.scene.ends_with("-dim"); });
  add("regimes", "auto", [](const EvidenceRow& row) { return row.scene.starts_with("regimes "); });
  if (chart.lines.empty()) return;
  figures.push_back(
      {.id = "autofocus-claims",
       .title = "Autofocus: whether the error that an answer tells is true",
       .read = "A mark is the share of auto's answers whose interval holds where the subject is (n up to " +
               std::to_string(most) +
               "), its line the 95 % Wilson interval; on the diagonal what is said is so, above it "
               "intervals are wider than needed, below it they promise too much.",
       .means = "Of answers that claim 95 %, so many hold: " + means +
                "; 93 to 99 % is the goal: more is wider than needed, less "
                "promises too much.",
       .chart = std::move(chart)});
}

std::string PlanSetName(const std::string& set) {
  return set == "1000000 pixels, one class of a depth map" ? "a depth map of 10^6 pixels" : set;
}

/// How many times as long as the best peer lensd takes.
std::string BesideBisection(const Evidence& rows, const std::string& set) {
  const EvidenceRow *ours = RowOf(rows, "plan", set, "lensd", "time"),
                    *peer = RowOf(rows, "plan", set, "bisection", "time");
  if (ours == nullptr || peer == nullptr) return "";
  const Estimate ratio = RatioOf(*ours, *peer);
  return " lensd takes " + Short(ratio.middle) + " times (" + Short(ratio.low) + " to " + Short(ratio.high) +
         ") as long as bisection, and tells every limit's worst case with it.";
}

void AddPlan(const Evidence& rows, std::vector<Figure>& figures) {
  const Evidence timed = Selected(rows, [](const EvidenceRow& row) {
    return row.family == "plan" && row.measure == "time" && !row.scene.starts_with("regime");
  });
  for (const std::string& set : Names(timed, &EvidenceRow::scene)) {
    ScatterChart chart{
        .x = {.label = "time for one plan [us] (median)", .log = true},
        .y = {.label = "largest error of the f-number, relative (nothing: drawn at 1e-16)", .log = true}};
    int repeats = 0;
    for (const EvidenceRow& row : timed) {
      if (row.scene != set) continue;
      if (row.role == "floor") chart.rules.push_back({.x = row.estimate.middle, .label = "reading it once"});
      const EvidenceRow* error = RowOf(rows, "plan", set, row.method, "error");
      const EvidenceRow* wrong = RowOf(rows, "plan", set, row.method, "wrong");
      if (error == nullptr || wrong == nullptr) continue;
      repeats = row.n;
      const bool breaks = wrong->estimate.middle > 0.0;
      const EvidenceRow* refused = RowOf(rows, "plan", set, row.method, "refused");
      if (refused != nullptr && refused->estimate.middle >= 1.0) continue;  // never an answer that could be off
      chart.marks.push_back({.x = row.estimate.middle,
                             .y = std::max(error->estimate.middle, kLeastError),
                             .x_range = row.estimate,
                             .series = breaks ? 5 : SeriesOf(row),
                             .label = row.method + std::string(TooWide(row.estimate, row.n) ? kUnsure : ""),
                             .tip = row.method + ": " + InWords(row) + ", error " + Short(error->estimate.middle) +
                                    ", wrong " + InWords(*wrong)});
    }
    if (chart.marks.size() < 2) continue;
    std::vector<ChartMark> right = chart.marks;
    std::erase_if(right, [](const ChartMark& mark) { return mark.series == 5; });
    const ChartLine front = FrontOf(right);
    chart.lines.push_back(front);
    figures.push_back(
        {.id = "plan-" + FileNameOf(set),
         .title = "Planner, " + PlanSetName(set) + ": time against error",
         .read = "Left is faster, down is more exact; a line is the 95 % interval of the median of " +
                 std::to_string(repeats) +
                 " processes; a cross breaks limits or calls what is possible impossible; a question "
                 "mark: its spread is too wide to judge.",
         .means = "On the front, without a wrong answer: " + ListOf(LabelsOf(front)) + "." + BesideBisection(rows, set),
         .chart = std::move(chart),
         .key = {{0, "lensd"}, {1, "peers"}, {5, "wrong answers among them"}}});
  }
}

/// Ratios to a floor, as dots: where all methods compute the same there is nothing to be more accurate in.
void AddDots(const Evidence& rows, const std::string& family, const std::string& floor, Figure figure,
             std::vector<Figure>& figures) {
  const Evidence timed =
      Selected(rows, [&](const EvidenceRow& row) { return row.family == family && row.measure == "time"; });
  if (timed.empty()) return;
  const auto base = std::ranges::find_if(timed, [&](const EvidenceRow& row) { return row.method == floor; });
  DotChart chart{.x = {.label = "time [" + timed.front().unit + "] (median)", .log = true},
                 .groups = {{.name = "", .rows = {}}}};
  bool wide = false;
  for (const EvidenceRow& row : timed) {
    std::string text = Short(row.estimate.middle) + " " + row.unit;
    if (base != timed.end() && row.method != floor) text += ", " + Short(RatioOf(row, *base).middle) + "x";
    const bool unsure = TooWide(row.estimate, row.n);
    wide = wide || unsure;
    chart.groups[0].rows.push_back(
        {.name = row.method,
         .marks = {{row.estimate, row.role == "floor" ? 2 : SeriesOf(row), row.method + ": " + InWords(row)}},
         .figure = text + (unsure ? " ?" : "")});
  }
  if (base != timed.end()) {
    chart.groups[0].floor = base->estimate.middle;
    chart.floor_label = floor;
  }
  figure.read += " n = " + std::to_string(timed.front().n) + " processes.";
  if (wide) figure.read += " A question mark: its spread is too wide to judge.";
  figure.chart = std::move(chart);
  figure.key = {{2, "floor"}, {0, "lensd"}};
  if (std::ranges::any_of(timed, [](const EvidenceRow& row) { return row.role == "peer"; }))
    figure.key.emplace_back(1, "peers");
  figures.push_back(std::move(figure));
}

void AddMove(const Evidence& rows, std::vector<Figure>& figures) {
  ScatterChart chart{
      .x = {.label = "time to within 5 % when calibrated [periods of the ringing]", .log = true},
      .y = {.label = "worst of what still swings after one period, frequency up to 10 % off [% of the step]",
            .log = true}};
  for (const std::string& method :
       Names(Selected(rows, [](const auto& row) { return row.family == "move"; }), &EvidenceRow::method)) {
    const EvidenceRow* time = RowOf(rows, "move", "voice coil", method, "time to 5 %", 0.0);
    double worst = 0.0;
    for (const EvidenceRow& row : rows) {
      if (row.family != "move" || row.method != method || row.measure != "residual after 1 period") continue;
      if (std::abs(*row.value) <= 10.0) worst = std::max(worst, row.estimate.middle);
    }
    if (time == nullptr || !std::isfinite(time->estimate.middle) || worst <= 0.0) continue;
    chart.marks.push_back({.x = time->estimate.middle,
                           .y = 100 * worst,
                           .series = SeriesOf(*time),
                           .label = method,
                           .tip = method + ": " + Short(time->estimate.middle) + " periods, " + Short(100 * worst) +
                                  " %; the simulator gives the same every time"});
  }
  if (chart.marks.empty()) return;
  chart.rules = {{.x = 0.5, .label = "half a period: two steps"}, {.y = 5.0, .label = "5 %"}};
  const ChartLine front = FrontOf(chart.marks);
  chart.lines.push_back(front);
  figures.push_back(
      {.id = "move",
       .title = "Moves of a ringing actuator: how soon it stands, and what an uncertain frequency costs",
       .read = "Left is faster, down is more robust; a mark is a way to command one step. The runs are "
               "simulated and exact, so there is no interval.",
       .means = "A raw step rings for dozens of periods; on the front are " + ListOf(LabelsOf(front)) + ".",
       .chart = std::move(chart),
       .key = kOursAndPeers});
}

}  // namespace

std::vector<Figure> SpeedFigures(const Evidence& rows) {
  std::vector<Figure> figures;
  AddAutofocus(rows, "frames", figures);
  AddAutofocus(rows, "time with computing", figures);
  AddClaims(rows, figures);
  AddWithin(rows, figures);
  AddPlan(rows, figures);
  AddRenderSpeed(rows, figures);
  AddDots(
      rows, "measure", "read memory once",
      {.id = "measure",
       .title = "Focus measures: time for one 1080p picture out of cold memory",
       .read = "Left is faster; lines are 95 % intervals of the median, the factor is that to reading the memory once.",
       .means = "They compute sums of the same kind, so that only time is compared.",
       .chart = {}},
      figures);
  AddDots(
      rows, "rpc", "epoll echo, GetInfo's bytes",
      {.id = "rpc",
       .title = "Questions to the daemon: the round trip, beside a bare socket and sd-bus",
       .read =
           "Left is faster; client and daemon share one processor, the factor is that to a process that echoes "
           "GetInfo's bytes. Rows of Status with lenses and clients are of 1,000 calls a second, offered whatever the "
           "answers take.",
       .means = "What is beyond the echo of as many bytes is the daemon's own work.",
       .chart = {}},
      figures);
  AddMove(rows, figures);
  AddDriverSpeed(rows, figures);
  return figures;
}

}  // namespace lensd::bench
