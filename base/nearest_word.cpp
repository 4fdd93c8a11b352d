// Damerau's distance in three rows, over lists of some dozens of words.
#include "base/nearest_word.h"

#include <algorithm>
#include <vector>

namespace lensd {
namespace {

/// Letters left out, added, exchanged, or swapped with their neighbour, no letter twice.
std::size_t Distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t exchanged = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, exchanged});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    before.swap(last);
    last.swap(row);
  }
  return last[b.size()];
}

}  // namespace

std::optional<std::string> NearestWord(std::string_view typed, std::span<const std::string> words) {
  if (typed.empty()) return std::nullopt;
  const auto begun = [&](const std::string& word) { return typed.size() >= 2 && word.starts_with(typed); };
  if (std::ranges::count_if(words, begun) == 1) return *std::ranges::find_if(words, begun);
  std::size_t nearest = std::max<std::size_t>(1, typed.size() / 3) + 1;
  std::optional<std::string> meant;
  for (const std::string& word : words) {
    const std::size_t distance = Distance(typed, word);
    if (distance > nearest) continue;
    if (distance < nearest) {
      meant = word;
    } else if (meant != word) {
      meant.reset();
    }
    nearest = distance;
  }
  return meant;
}

}  // namespace lensd
