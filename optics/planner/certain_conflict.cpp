// A set of names that turns out to be feasible lacks what its own plan breaks. Adding that ends after a few rounds,
// since each adds what no round before had.
#include "optics/planner/certain_conflict.h"

#include <algorithm>

namespace lensd::optics {

std::vector<int> CertainConflict(std::vector<int> guess, const std::vector<int>& everything, const Refute& refute) {
  constexpr int kMostRounds = 64;
  constexpr std::size_t kFew = 16;
  bool grown = false;
  for (int round = 0;; ++round) {
    const auto broken = refute(guess);
    if (!broken) break;
    const std::size_t before = guess.size();
    for (const int name : *broken) {
      if (std::ranges::find(guess, name) == guess.end()) guess.push_back(name);
    }
    if (guess.size() == before || round == kMostRounds) return everything;
    grown = true;
  }
  if (!grown || guess.size() > kFew) return guess;
  for (std::size_t i = guess.size(); i-- > 0 && guess.size() > 1;) {
    std::vector<int> fewer = guess;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(i));
    if (!refute(fewer)) guess = std::move(fewer);
  }
  return guess;
}

}  // namespace lensd::optics
