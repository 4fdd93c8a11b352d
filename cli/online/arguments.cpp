// Names and values of the commands for one lens: a word that reads as a quantity or an axis is not a name.
#include "cli/online/arguments.h"

#include <algorithm>
#include <array>

namespace lensd::cli {

NameAndValue SplitNameAndValue(const std::vector<std::string>& words) {
  if (words.size() == 2) return {words[0], words[1]};
  return {nullptr, words.empty() ? "" : words[0]};
}

bool IsAxis(std::string_view word) {
  constexpr std::array<std::string_view, 4> kAxes = {"focus", "iris", "zoom", "filter"};
  return std::ranges::find(kAxes, word) != kAxes.end();
}

varlink::Json LensOf(const std::string& name) {
  return name.empty() ? varlink::Json(nullptr) : varlink::Json(name);
}

}  // namespace lensd::cli
