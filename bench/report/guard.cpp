// Accuracy by intervals, speed by ratios to what ran beside it.
#include "bench/report/guard.h"

#include <algorithm>
#include <cmath>

#include "bench/report/figures.h"

namespace lensd::bench {
namespace {

std::string NameOf(const EvidenceRow& row) {
  return row.family + ", " + row.scene + ", " + row.method + (row.sweep.empty() ? "" : ", " + row.sweep) +
         (row.value ? " at " + Short(*row.value) : "") + ": " + row.measure;
}

/// Timed by the machine's clock; autofocus' times are simulated.
bool IsTiming(const EvidenceRow& row) {
  return row.family != "autofocus" && row.measure.starts_with("time") && !row.samples.empty();
}

/// The row of the same figure: 20 % of answers lost and answers late by 20 ms are two.
const EvidenceRow* Same(const std::vector<EvidenceRow>& rows, const EvidenceRow& as) {
  const auto found = std::ranges::find_if(rows, [&](const EvidenceRow& row) {
    return row.family == as.family && row.scene == as.scene && row.method == as.method && row.measure == as.measure &&
           row.sweep == as.sweep && row.value == as.value;
  });
  return found == rows.end() ? nullptr : &*found;
}

/// In which direction is a figure of accuracy better? 0: it is none.
int BetterIs(const EvidenceRow& row) {
  if (row.measure == "within") return 1;
  // A refusal is right in some scenes; where runs move from within to refused, "within" tells.
  if (row.measure.starts_with("claim of")) return 1;
  const bool of_the_machine = row.measure == "cpu" || row.measure == "move" || row.measure == "verified" ||
                              row.measure.starts_with("time, ") || row.measure == "time with computing" ||
                              row.measure.starts_with("floor of the ");
  if (row.measure == "refused" || of_the_machine)
    return row.scene == "regimes gradient" && row.measure == "refused" ? 1 : 0;
  return -1;
}

bool Worse(const EvidenceRow& before, const EvidenceRow& now) {
  const int better = BetterIs(now);
  if (better == 0) return false;
  const Estimate &old = before.estimate, &fresh = now.estimate;
  const bool intervals = now.unit == "share" || !now.samples.empty();
  if (intervals) return better > 0 ? fresh.high < old.low : fresh.low > old.high;
  const double more = better > 0 ? old.middle - fresh.middle : fresh.middle - old.middle;
  // An error of rounding may change with the compiler; twice nothing is nothing.
  return more > std::max(0.01 * std::abs(old.middle), 1e-12);
}

/// The ratio of ours to another, worse than before by more than 30 % in at least two thirds of the repeats.
bool Slower(const EvidenceRow& ours, const EvidenceRow& other, double before) {
  const std::size_t n = std::min(ours.samples.size(), other.samples.size());
  std::size_t slow = 0;
  for (std::size_t i = 0; i < n; ++i) slow += ours.samples[i] / other.samples[i] > 1.3 * before;
  return n > 0 && 3 * slow >= 2 * n;
}

/// Every floor and peer of the same scene speaks: a machine that reads memory slower is not our fault, nor is a peer
/// that an update made faster. So ours is slower only where all of them say so.
std::string SlowerIn(const std::vector<EvidenceRow>& before, const std::vector<EvidenceRow>& now,
                     const EvidenceRow& ours) {
  const EvidenceRow* ours_before = Same(before, ours);
  // Even ratios to a floor are a machine's own: what is three times a read of slow memory is ten times one of fast.
  if (ours_before->made.machine != ours.made.machine || ours_before->made.compiler != ours.made.compiler) return "";
  int beside = 0, slower = 0;
  for (const EvidenceRow& other : now) {
    if (other.role == "ours" || other.family != ours.family || other.scene != ours.scene || other.value != ours.value ||
        other.measure != ours.measure)
      continue;
    const EvidenceRow* other_before = Same(before, other);
    if (other_before == nullptr) continue;
    ++beside;
    slower += Slower(ours, other, RatioOf(*ours_before, *other_before).middle);
  }
  if (beside == 0 || slower < beside) return "";
  return NameOf(ours) + " is more than 30 % slower against all of " + std::to_string(beside) +
         " floors and peers: now " + InWords(ours) + ", before " + InWords(*ours_before);
}

}  // namespace

std::vector<std::string> WorseThan(const std::vector<EvidenceRow>& before, const std::vector<EvidenceRow>& now) {
  std::vector<std::string> worse;
  for (const EvidenceRow& old : before) {
    if (old.role != "ours") continue;
    const EvidenceRow* fresh = Same(now, old);
    if (fresh == nullptr) {
      worse.push_back(NameOf(old) + " is no longer measured");
    } else if (IsTiming(*fresh)) {
      // The slowest calls are the machine's, and say nothing where few are timed.
      const std::string line = fresh->measure == "time" ? SlowerIn(before, now, *fresh) : "";
      if (!line.empty()) worse.push_back(line);
    } else if (Worse(old, *fresh)) {
      worse.push_back(NameOf(*fresh) + " is worse: now " + InWords(*fresh) + ", before " + InWords(old));
    }
  }
  return worse;
}

}  // namespace lensd::bench
