// The regimes of failure, with what this evidence says of them.
#include <algorithm>
#include <cmath>
#include <string_view>

#include "bench/report/figures.h"

namespace lensd::bench {
namespace {

using Kind = Verdict::Kind;

constexpr double kRounding = 1e-3;  // of 255: what sums of single precision leave

/// A regime of the list, and where it is run: what is counted, and what is swept until it fails.
struct Regime {
  const char* name;
  std::vector<const char*> scenes;
  bool must_refuse = false;
  bool may_refuse = false;  ///< a refusal may name the depths, and counts as right

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
  Verdict verdict{
      .work = regime.name,
      .ours = "not run",
      .goal = regime.must_refuse ? "refused in every run"
              : regime.may_refuse
                  ? "97 % within or refused (the rows do not tell whether it named the depths); false at most 0.1 %"
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
  const auto with_edges = [&](const std::string& words) {
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
