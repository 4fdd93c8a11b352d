// Keeps figures from getting worse unnoticed.
#pragma once

#include <string>
#include <vector>

#include "bench/evidence/rows.h"

namespace lensd::bench {

/// One line for every figure of `now` that is worse than in `before`: an accuracy (errors, bounds, shares of outcomes)
/// worse beyond both intervals, or more than 1 % where it is the same in every run; a time of ours whose ratio to each
/// floor or peer beside it is more than 30 % above the baseline's in most repeats (two of three), where machine and
/// compiler are the baseline's. Rows of `before` that
/// `now` lacks are told, too: a guard that no longer looks is none.
std::vector<std::string> WorseThan(const std::vector<EvidenceRow>& before, const std::vector<EvidenceRow>& now);

}  // namespace lensd::bench
