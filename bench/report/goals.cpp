// "Numbers to beat" and the regimes of failure, with what this evidence says of them.
#include <algorithm>
#include <array>
#include <cmath>

#include "bench/report/figures.h"

namespace lensd::bench {
namespace {

using Kind = Verdict::Kind;

/// One comparison of times: ours at most so many times another's in the same processes.
struct RatioGoal {
  const char* work;
  const char* family;
  const char* scene;
  const char* ours;
  const char* floor;
  const char* peer;  ///< null: none
  const char* goal;
  double of_floor;  ///< 0: not asked
  double of_peer;   ///< 0: not asked
  const char* measure = "time";
};

// An absolute goal of one machine is asked as a ratio to the peer that was measured there beside it.
constexpr const char* kReading = "reading the numbers once";
constexpr const char* kMemory = "read memory once";
constexpr double kRounding = 1e-3;  // of 255: what sums of single precision leave
constexpr double kSameBlur = 0.5;   // of 255: beyond it, it is not the disk that was asked for
constexpr RatioGoal kRatioGoals[] = {
    {"plan, up to 8 limits", "plan", "up to 8 limits", "lensd", kReading, "bisection",
     "0.7 us where bisection takes 0.5: 1.4x", 0, 1.4},
    {"plan, 100 limits", "plan", "100 limits", "lensd", kReading, "bisection", "3 us where bisection takes 6.4: 0.47x",
     0, 0.47},
    {"plan, 65,536 named depths", "plan", "65,536 named depths", "lensd", kReading, "bisection",
     "3 ms for 10^6, where one read takes 0.77: 3.9x a read", 3.9, 0},
    {"plan, a depth map of 10^6 pixels", "plan", "1000000 pixels, one class of a depth map", "lensd", kReading, nullptr,
     "0.5 ms where one read takes 0.35: 1.43x a read", 1.43, 0},
    {"Tenengrad, 1080p, cold", "measure", "1080p, 8 bits", "lensd Tenengrad", kMemory, "OpenCV Tenengrad, tuned",
     "4x a read, 8 times as fast as OpenCV", 4, 0.125},
    {"Laplacian, 1080p, cold", "measure", "1080p, 8 bits", "lensd Laplacian", kMemory, nullptr, "3x a read", 3, 0},
    {"Brenner, 1080p, cold", "measure", "1080p, 8 bits", "lensd Brenner", kMemory, nullptr, "1.3x a read", 1.3, 0},
    {"one socket request", "rpc", "one client", "lensd GetInfo", "epoll echo, GetInfo's bytes",
     "sd-bus, the plan's text", "1.5x a bare socket", 1.5, 0},
    {"one socket request, 99.9 % of calls", "rpc", "one client", "lensd GetInfo", "epoll echo, GetInfo's bytes",
     nullptr, "2x a bare socket", 2, 0, "time, 99.9 % of calls"}};

Verdict Judge(const Evidence& rows, const RatioGoal& goal) {
  Verdict verdict{.work = goal.work, .ours = "not run", .goal = goal.goal, .words = "no rows of it yet"};
  const EvidenceRow* ours = RowOf(rows, goal.family, goal.scene, goal.ours, goal.measure);
  if (ours == nullptr) return verdict;
  verdict.ours = InWords(*ours);
  verdict.words.clear();
  bool missed = false, judged = false;
  const auto against = [&](const EvidenceRow& other, double factor, std::string& cell) {
    const Estimate ratio = RatioOf(*ours, other);
    cell = other.method + " " + InWords(other) + "; ours is " + Short(ratio.middle) + "x (" + Short(ratio.low) +
           " to " + Short(ratio.high) + ")";
    if (factor <= 0.0) return;
    judged = true;
    if (ratio.high <= factor) return;
    const bool sure = ratio.low > factor;
    missed = missed || sure;
    verdict.words += (verdict.words.empty() ? "" : "; ") +
                     ("takes " + Short(ratio.middle) + "x where " + Short(factor) + "x is the goal") +
                     (sure ? "" : ", which its interval includes: not to be judged from these runs");
  };
  if (const auto* floor = RowOf(rows, goal.family, goal.scene, goal.floor, goal.measure))
    against(*floor, goal.of_floor, verdict.floor);
  const EvidenceRow* peer =
      goal.peer != nullptr ? RowOf(rows, goal.family, goal.scene, goal.peer, goal.measure) : nullptr;
  if (peer != nullptr)
    against(*peer, goal.of_peer, verdict.peer);
  else if (goal.of_peer > 0.0)
    verdict.words += (verdict.words.empty() ? "" : "; ") + std::string("the peer is not installed on this machine");
  verdict.kind = missed ? Kind::Missed : judged && verdict.words.empty() ? Kind::Met : Kind::Open;
  return verdict;
}

/// The best of ours and of the peers at one diameter, by time.
Verdict JudgeDisk(const Evidence& rows, double diameter) {
  Verdict verdict{.work = "blur 1080p by a disk of " + Short(diameter) + " px",
                  .ours = "not run",
                  .goal = diameter == 15 ? "half the best peer's time" : "no slower than the best peer",
                  .words = "no rows of it yet"};
  const EvidenceRow *ours = nullptr, *peer = nullptr, *floor = nullptr;
  for (const EvidenceRow& row : rows) {
    if (row.family != "render" || row.measure != "time" || row.value != diameter) continue;
    // Blurs of another shape are no peers in this.
    const EvidenceRow* error = RowOf(rows, "render", row.scene, row.method, "error", diameter);
    if (row.role == "peer" && error != nullptr && error->estimate.middle > kSameBlur) continue;
    const EvidenceRow*& best = row.role == "ours" ? ours : row.role == "peer" ? peer : floor;
    if (best == nullptr || row.estimate.middle < best->estimate.middle) best = &row;
  }
  if (ours == nullptr) return verdict;
  verdict.ours = ours->method + " " + InWords(*ours);
  if (floor != nullptr) {
    verdict.floor = floor->method + " " + InWords(*floor) + "; ours is " + Short(RatioOf(*ours, *floor).middle) + "x";
  }
  verdict.words = "no peer is installed on this machine";
  if (peer == nullptr) return verdict;
  const Estimate ratio = RatioOf(*ours, *peer);
  verdict.peer = peer->method + " " + InWords(*peer) + "; ours is " + Short(ratio.middle) + "x";
  const double goal = diameter == 15 ? 0.5 : 1.0;
  const bool met = ratio.high <= goal, sure = met || ratio.low > goal;
  verdict.kind = met ? Kind::Met : sure ? Kind::Missed : Kind::Open;
  verdict.words = met ? ""
                      : "takes " + Short(ratio.middle) + "x of it (" + Short(ratio.low) + " to " + Short(ratio.high) +
                            ")" + (sure ? "" : ", which includes the goal: not to be judged from these runs");
  for (const char* library : {"OpenCV", "FFTW"}) {
    const bool there = std::ranges::any_of(rows, [&](const EvidenceRow& row) {
      return row.family == "render" && row.value == diameter && row.method.find(library) != std::string::npos;
    });
    if (!there && met) {
      verdict.kind = Kind::Open;
      verdict.words += (verdict.words.empty() ? "" : "; ") + std::string(library) + " was not there to be timed";
    }
  }
  return verdict;
}

Verdict JudgeVarying(const Evidence& rows) {
  Verdict verdict{.work = "blur varying from 1 to 41 px over the frame",
                  .ours = "not run",
                  .goal = "100 ms where the naive gather takes 2.1 s: 1/21; error 0.25 of 255",
                  .words = "no rows of it yet"};
  const EvidenceRow *ours = RowOf(rows, "render", "varying disk", "lensd gather", "time"),
                    *naive = RowOf(rows, "render", "varying disk", "naive gather", "time"),
                    *error = RowOf(rows, "render", "varying disk", "lensd gather", "error");
  if (ours == nullptr || naive == nullptr || error == nullptr) return verdict;
  const Estimate ratio = RatioOf(*ours, *naive);
  verdict.ours = InWords(*ours) + ", error " + Short(error->estimate.middle) + " of 255";
  verdict.peer = "naive gather " + InWords(*naive) + "; ours is 1/" + Short(1 / ratio.middle);
  const bool met = ours->estimate.middle <= 100.0 && error->estimate.middle <= 0.25;
  verdict.kind = met ? Kind::Met : Kind::Missed;
  verdict.words = met ? "" : "misses 100 ms or 0.25 of 255";
  return verdict;
}

Verdict JudgePlanner(const Evidence& rows) {
  const auto [wrong, all] = Counted(Selected(rows, [](const EvidenceRow& row) {
    return row.family == "plan" && row.method == "lensd" && row.measure == "wrong";
  }));
  Verdict verdict{.work = "planner's verdicts",
                  .ours = all > 0 ? ShareInWords(wrong, all) + " wrong" : "not run",
                  .floor = "exact rational arithmetic",
                  .goal = "0 wrong of 10^6 adversarial cases"};
  verdict.kind = wrong > 0 ? Kind::Missed : Kind::Open;
  verdict.words = wrong > 0 ? "there are wrong ones"
                            : "none wrong here; a million adversarial cases are the test optics_planner_exact at "
                              "LENSD_TEST_LEVEL=long, not this table's";
  return verdict;
}

Verdict JudgeMove(const Evidence& rows) {
  Verdict verdict{.work = "a motor move, ringing actuator",
                  .ours = "not run",
                  .floor = "0.5 periods (two steps)",
                  .goal = "5 % left after 0.75 periods, calibrated",
                  .words = "no rows of it yet"};
  const EvidenceRow *ours = RowOf(rows, "move", "voice coil", "zv", "residual after 0.75 periods", 0.0),
                    *raw = RowOf(rows, "move", "voice coil", "raw", "time to 5 %", 0.0);
  if (ours == nullptr) return verdict;
  verdict.ours = "zv: " + Short(100 * ours->estimate.middle) + " % left";
  if (raw != nullptr) verdict.peer = "raw step: 5 % after " + Short(raw->estimate.middle) + " periods";
  verdict.kind = ours->estimate.middle <= 0.05 ? Kind::Met : Kind::Missed;
  verdict.words = verdict.kind == Kind::Met ? "" : "more than 5 % is left";
  return verdict;
}

bool Ordinary(const EvidenceRow& row) {
  return row.scene.starts_with("score ") && !row.scene.ends_with("-dim");
}
bool Dim(const EvidenceRow& row) {
  return row.scene.ends_with("-dim") || row.scene == "regimes low-light";
}
bool OnStacks(const EvidenceRow& row) {
  return row.scene == "real stacks, one depth";
}

/// Shares and frames of auto over the scenes that `in` takes.
Verdict JudgeAutofocus(const Evidence& rows, const char* work, bool (*in)(const EvidenceRow&), double within_goal,
                       double refused_goal, double false_goal, double frames_goal, const char* goal) {
  const auto of = [&](const char* method, const char* measure) {
    return Selected(rows, [&](const EvidenceRow& row) {
      return row.family == "autofocus" && row.sweep.empty() && row.method == method && row.measure == measure &&
             in(row);
    });
  };
  Verdict verdict{.work = work, .ours = "not run", .goal = goal, .words = "no rows of it yet"};
  const auto [within, runs] = Counted(of("auto", "within"));
  if (runs == 0) return verdict;
  const auto [wrong, n] = Counted(of("auto", "false"));
  const auto [refused, m] = Counted(of("auto", "refused"));
  const Estimate frames = Pooled(of("auto", "frames"));
  verdict.ours = "within " + ShareInWords(within, runs) + ", false " + ShareInWords(wrong, runs) + ", refused " +
                 ShareInWords(refused, runs) + ", " + Short(frames.middle) + " frames (" + Short(frames.low) + " to " +
                 Short(frames.high) + ")";
  if (const Evidence moves = of("auto", "moves"); !moves.empty())
    verdict.ours += ", " + Short(Pooled(moves).middle) + " moves (2 after the first frame were aimed at)";
  std::string best;
  double most = -1.0;
  for (const std::string& method : Names(
           Selected(rows,
                    [&](const EvidenceRow& row) { return row.family == "autofocus" && row.role == "peer" && in(row); }),
           &EvidenceRow::method)) {
    const auto [hits, tries] = Counted(of(method.c_str(), "within"));
    if (tries == 0 || static_cast<double>(hits) / tries <= most) continue;
    most = static_cast<double>(hits) / tries;
    best = method + ": within " + ShareInWords(hits, tries) + ", " +
           Short(Pooled(of(method.c_str(), "frames")).middle) + " frames";
  }
  verdict.peer = best;
  verdict.words.clear();
  bool sure = true;
  const auto judge = [&](int hits, double limit, bool at_least, const char* name) {
    const Estimate share = ShareOf(hits, runs);
    if (at_least ? share.middle < limit : share.middle > limit)
      verdict.words += (verdict.words.empty() ? "" : "; ") + std::string(name) + " " + Short(100 * share.middle, 4) +
                       " % where " + Short(100 * limit, 4) + " % is the goal";
    sure = sure && (at_least ? share.low >= limit : share.high <= limit);
  };
  judge(within, within_goal, true, "within");
  judge(wrong, false_goal, false, "false");
  if (refused_goal < 1.0) judge(refused, refused_goal, false, "refused");
  if (frames.middle > frames_goal)
    verdict.words += (verdict.words.empty() ? "" : "; ") + Short(frames.middle) + " frames where " +
                     Short(frames_goal) + " is the goal";
  verdict.kind = !verdict.words.empty() ? Kind::Missed : sure ? Kind::Met : Kind::Open;
  if (verdict.kind == Kind::Open)
    verdict.words = "met as counted; " + std::to_string(runs) + " runs are too few to prove it";
  return verdict;
}

/// How long a user waits, as so many times what one who knew the answer takes.
Verdict JudgeTime(const Evidence& rows) {
  const auto of = [&](const char* measure) {
    return Selected(rows, [&](const EvidenceRow& row) {
      return row.family == "autofocus" && row.sweep.empty() && row.method == "auto" && row.measure == measure &&
             Ordinary(row);
    });
  };
  Verdict verdict{.work = "autofocus, time to focus with that of computing, ordinary simulated scenes",
                  .ours = "not run",
                  .goal = "1.5 times the move, its settling and two frames, on a lens that was measured",
                  .words = "no rows of it yet"};
  const Evidence waited = of("time with computing"), known = of("floor of the time");
  if (waited.empty() || known.empty()) return verdict;
  const Estimate ours = Pooled(waited), floor = Pooled(known);
  const double times = ours.middle / floor.middle;
  verdict.ours = Short(ours.middle) + " ms (" + Short(ours.low) + " to " + Short(ours.high) + ")";
  verdict.floor = Short(floor.middle) + " ms for one who knew the answer; ours is " + Short(times) + "x";
  verdict.kind = times <= 1.5 ? Kind::Met : Kind::Missed;
  verdict.words = times <= 1.5 ? "" : "takes " + Short(times) + "x on lenses that were not measured";
  return verdict;
}

/// A regime of the list, and where it is run: what is counted, and what is swept until it fails.
struct Regime {
  const char* name;
  std::vector<const char*> scenes;
  bool must_refuse = false;
  bool may_refuse = false;  ///< a refusal that names the depths is right too

  bool Sweeps(const EvidenceRow& row) const {
    return row.scene.starts_with("sweep ") && std::ranges::find(scenes, row.scene) != scenes.end();
  }
  bool Counts(const EvidenceRow& row) const {
    const auto swept = [](const std::string_view scene) { return scene.starts_with("sweep "); };
    return std::ranges::find(scenes, row.scene) != scenes.end() &&
           (std::ranges::all_of(scenes, swept) || !swept(row.scene));
  }
};

const std::vector<Regime>& Regimes() {
  static const std::vector<Regime> regimes = {
      {"1 no texture, or a linear gradient (must refuse)", {"regimes gradient"}, true},
      {"2 low light",
       {"regimes low-light", "score cloth-dim", "score foliage-dim", "score ground-dim", "score leaves-dim",
        "score page-dim", "score plaster-dim"}},
      {"3 several depths in the window",
       {"regimes two-depths", "regimes tilted", "real stacks, several depths"},
       false,
       true},
      {"4 saturated lights (false peak)", {"regimes lights"}},
      {"5 periodic texture (spurious resolution)", {"regimes sinusoid"}},
      {"6 texture along one direction only", {"regimes stripes"}},
      {"7 gross defocus plateau", {"sweep defocus"}},
      {"8 peak at the end of the range", {"regimes end-of-range"}},
      {"9 step much wider than the peak, or below the noise", {"regimes coarse-steps", "regimes fine-steps"}},
      {"10 wrong PSF, wrong A or f, breathing",
       {"score foliage-perturbed", "score ground-perturbed", "score plaster-perturbed", "score foliage-breathing",
        "sweep f-number", "sweep blades", "sweep spherical", "sweep coma"}},
      {"11 flicker and exposure drift", {"regimes flicker", "sweep flicker"}},
      {"12 camera or subject motion", {"regimes shake", "regimes swaying", "sweep vibration", "sweep subject-speed"}},
      {"13 backlash, sampling before settled, latency",
       {"regimes worn-mechanics", "regimes ringing", "score ground-backlash", "sweep backlash", "sweep latency"}},
      {"14 small windows", {"regimes small-window", "sweep window"}}};
  return regimes;
}

/// From where on in each sweep auto is certainly below nine runs in ten.
std::string EdgesOf(const Evidence& rows, const Regime& regime) {
  std::string text;
  const Evidence swept = Selected(rows, [&](const EvidenceRow& row) {
    return row.method == "auto" && row.measure == "within" && regime.Sweeps(row);
  });
  for (const std::string& scene : Names(swept, &EvidenceRow::scene)) {
    std::string at;
    for (const EvidenceRow& row : swept) {
      if (row.scene == scene && row.estimate.high < 0.9) at += (at.empty() ? "" : ", ") + Short(*row.value);
    }
    text += (text.empty() ? "swept until it fails: " : "; ") + scene.substr(6) +
            (at.empty() ? " nowhere in its range" : " at " + at);
  }
  return text;
}

Verdict JudgeRegime(const Evidence& rows, const Regime& regime) {
  const char* const measure = regime.must_refuse ? "refused" : "within";
  const auto counted = [&](const std::string& method, const char* what) {
    return Counted(Selected(rows, [&](const EvidenceRow& row) {
      return row.family == "autofocus" && row.method == method && row.measure == what && regime.Counts(row);
    }));
  };
  Verdict verdict{.work = regime.name,
                  .ours = "not run",
                  .goal = regime.must_refuse  ? "refused in every run"
                          : regime.may_refuse ? "97 % within, or refused with the depths named; false at most 0.1 %"
                                              : "97 % within, false at most 0.1 %",
                  .words = "no rows of it yet"};
  const auto [direct, runs] = counted("auto", measure);
  if (runs == 0) return verdict;
  const auto [wrong, n] = counted("auto", "false");
  const int refused = regime.may_refuse ? counted("auto", "refused").first : 0, right = direct + refused;
  verdict.ours = std::string(measure) + " " + ShareInWords(direct, runs) +
                 (regime.may_refuse ? ", refused " + ShareInWords(refused, runs) : "") + ", false " +
                 ShareInWords(wrong, runs);
  double most = -1.0;
  for (const std::string& method :
       Names(Selected(rows, [](const EvidenceRow& row) { return row.family == "autofocus" && row.role == "peer"; }),
             &EvidenceRow::method)) {
    const auto [hits, tries] = counted(method, measure);
    // On the same cases alone.
    if (tries != runs || static_cast<double>(hits) / tries <= most) continue;
    most = static_cast<double>(hits) / tries;
    const auto [lies, all] = counted(method, "false");
    verdict.peer = method + ": " + measure + " " + ShareInWords(hits, tries) + ", false " + ShareInWords(lies, all);
  }
  const double share = static_cast<double>(right) / runs, lied = static_cast<double>(wrong) / runs;
  const bool met = regime.must_refuse ? right == runs : share >= 0.97 && lied <= 0.001;
  const bool proved = ShareOf(right, runs).low >= 0.97 && (regime.must_refuse || ShareOf(wrong, runs).high <= 0.001);
  const std::string edges = EdgesOf(rows, regime);
  const auto with_edges = [&](std::string words) {
    return words + (words.empty() || edges.empty() ? "" : "; ") + edges;
  };
  verdict.kind = !met ? Kind::Missed : proved ? Kind::Met : Kind::Open;
  if (verdict.kind == Kind::Open) {
    verdict.words = with_edges("met as counted; " + std::to_string(runs) + " runs are too few to prove it");
    return verdict;
  }
  if (!met) {
    verdict.words = share < (regime.must_refuse ? 1.0 : 0.97) ? "too few runs end rightly"
                                                              : "false focus in " + std::to_string(wrong) + " runs";
  }
  verdict.words = with_edges(verdict.words);
  return verdict;
}

}  // namespace

std::vector<Verdict> GoalVerdicts(const Evidence& rows) {
  std::vector<Verdict> verdicts;
  for (const RatioGoal& goal : kRatioGoals) verdicts.push_back(Judge(rows, goal));
  verdicts.push_back({.work = "requests with 16 of them under way (stretch)",
                      .ours = "not run",
                      .goal = "300,000 a second",
                      .kind = Kind::Open,
                      .words = "one client has one call under way in these runs"});
  verdicts.push_back(JudgePlanner(rows));
  for (const double diameter : {5.0, 15.0, 41.0, 101.0}) verdicts.push_back(JudgeDisk(rows, diameter));
  verdicts.push_back(JudgeVarying(rows));
  verdicts.push_back(JudgeMove(rows));
  verdicts.push_back(JudgeAutofocus(rows, "autofocus, ordinary simulated scenes", Ordinary, 0.995, 1.0, 0.001, 3,
                                    "99.5 % within, false 0.1 %, 3 frames"));
  verdicts.push_back(JudgeTime(rows));
  verdicts.push_back(
      JudgeAutofocus(rows, "autofocus, low light", Dim, 0.97, 1.0, 0.001, 5, "97 % within, false 0.1 %, 5 frames"));
  verdicts.push_back(JudgeAutofocus(rows, "autofocus, real stacks, a lens not measured", OnStacks, 0.97, 0.02, 0.0, 5,
                                    "97 % within, refused 2 %, false 0, 5 frames"));
  verdicts.push_back({.work = "autofocus, real stacks, a lens that was measured",
                      .ours = "not run",
                      .goal = "97 % within, refused 2 %, false 0, 3 frames",
                      .kind = Kind::Open,
                      .words = "a learned slope does not spare frames on these stacks (docs/autofocus.md)"});
  return verdicts;
}

std::vector<Verdict> RegimeVerdicts(const Evidence& rows) {
  std::vector<Verdict> verdicts;
  for (const Regime& regime : Regimes()) verdicts.push_back(JudgeRegime(rows, regime));
  const auto [wrong, problems] = Counted(Selected(rows, [](const EvidenceRow& row) {
    return row.family == "plan" && row.method == "lensd" && row.measure == "wrong";
  }));
  const bool with_regimes = std::ranges::any_of(
      rows, [](const EvidenceRow& row) { return row.family == "plan" && row.scene.starts_with("regime: "); });
  verdicts.push_back({.work = "15 planner: ends of the range, clamps, near-equal targets, infeasible mixes",
                      .ours = problems > 0 ? ShareInWords(wrong, problems) + " wrong" : "not run",
                      .goal = "0 wrong",
                      .kind = wrong > 0      ? Kind::Missed
                              : with_regimes ? Kind::Met
                                             : Kind::Open,
                      .words = with_regimes ? "" : "the regimes were not run"});
  int scenes = 0, held = 0;
  std::string broken;
  for (const EvidenceRow& row : rows) {
    if (row.family != "render" || row.measure != "bound") continue;
    const EvidenceRow* error = RowOf(rows, "render", row.scene, row.method, "error");
    if (error == nullptr) continue;
    ++scenes;
    const bool holds = error->estimate.middle <= std::max(row.estimate.middle, kRounding);
    held += holds;
    if (!holds) broken += (broken.empty() ? "" : ", ") + row.method + " on " + row.scene;
  }
  verdicts.push_back(
      {.work = "16 renderer: layers both defocused, thin occluder, tilted plane through focus, depth map",
       .ours = scenes > 0 ? "bound held in " + ShareInWords(held, scenes) : "not run",
       .goal = "every stated bound holds, or the error is below 0.001 of 255",
       .kind = scenes == 0      ? Kind::Open
               : held == scenes ? Kind::Met
                                : Kind::Missed,
       .words = scenes == 0      ? "no rows of it yet"
                : held == scenes ? ""
                                 : "exceeded by " + broken});
  return verdicts;
}

}  // namespace lensd::bench
