// Minimal conflicts by QuickXplain (Junker 2004): of the suspects, keep a half fixed and find what the other half must
// add; a set of s names out of m takes about 2 s log2(m/s) verdicts. Every verdict is certain, so the set is minimal.
#include "optics/planner/minimal_conflict.h"

#include <algorithm>

#include "optics/planner/solve.h"

namespace lensd::optics {

namespace {

class Minimiser {
 public:
  Minimiser(const SideAssignments& cases, const PlanRequest& request) : cases_(cases), request_(request) {}

  bool Feasible(const std::vector<int>& names) const {
    const auto has = [&](int name) { return std::find(names.begin(), names.end(), name) != names.end(); };
    ActiveLimits in_force{std::vector<char>(request_.limits.size(), 0), has(kFNumberName), has(kExtensionName),
                          has(kFocusName)};
    for (const int name : names) {
      if (name >= 0) in_force.limits[static_cast<std::size_t>(name)] = 1;
    }
    in_force.depth = has(kDepthName);
    const std::optional<ActiveLimits> given = cases_.WithoutOpen(in_force);
    return (!given || Feasible(*given)) && Feasible(in_force);
  }

  bool Feasible(const ActiveLimits& in_force) const {
    bool feasible = false;
    cases_.ForEach(in_force, [&](Subproblem& task) {
      feasible = SolveForN(task).feasible;
      return !feasible;
    });
    return feasible;
  }

  enum class Kept { Same, Grown };  ///< since the verdict before
  /// The names of `suspects` that are needed beside `kept`, with which they are infeasible.
  std::vector<int> Needed(const std::vector<int>& kept, Kept change, const std::vector<int>& suspects) const {
    if (change == Kept::Grown && !Feasible(kept)) return {};
    if (suspects.size() <= 1) return suspects;
    const auto middle = suspects.begin() + static_cast<std::ptrdiff_t>(suspects.size() / 2);
    const std::vector<int> first(suspects.begin(), middle), second(middle, suspects.end());
    const std::vector<int> of_second = Needed(Joined(kept, first), Kept::Grown, second);
    std::vector<int> of_first = Needed(Joined(kept, of_second), of_second.empty() ? Kept::Same : Kept::Grown, first);
    return Joined(of_first, of_second);
  }

 private:
  static std::vector<int> Joined(std::vector<int> a, const std::vector<int>& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
  }

  const SideAssignments& cases_;
  const PlanRequest& request_;
};

}  // namespace

std::vector<int> MinimalConflict(const SideAssignments& cases, const PlanRequest& request,
                                 const std::set<int>& suspects) {
  const Minimiser minimiser(cases, request);
  std::vector<int> names(suspects.begin(), suspects.end());
  if (minimiser.Feasible(names)) {  // the search ended on less than a proof: anything may be part of it
    names = {kFocusName, kFNumberName, kExtensionName, kDepthName};
    for (std::size_t i = 0; i < request.limits.size(); ++i) names.push_back(static_cast<int>(i));
  }
  return minimiser.Needed({}, Minimiser::Kept::Same, names);
}

std::vector<int> EveryName(const PlanRequest& request) {
  std::vector<int> names{kFNumberName, kExtensionName};
  if (request.focus) names.push_back(kFocusName);
  if (request.objective == Objective::Depth) names.push_back(kDepthName);
  for (std::size_t i = 0; i < request.limits.size(); ++i) names.push_back(static_cast<int>(i));
  return names;
}

std::vector<std::string> Spelled(const PlanRequest& request, std::vector<int> names) {
  std::sort(names.begin(), names.end(), [](int a, int b) {
    return (a < 0) != (b < 0) ? b < 0 : a < 0 ? a > b : a < b;
  });
  std::vector<std::string> spelled;
  for (const int name : names) {
    spelled.push_back(name >= 0                ? request.limits[static_cast<std::size_t>(name)].name
                      : name == kFocusName     ? "focus"
                      : name == kFNumberName   ? "fNumber"
                      : name == kExtensionName ? "extension"
                                               : "depth");
  }
  return spelled;
}

std::vector<int> Numbered(const PlanRequest& request, const std::vector<std::string>& names) {
  const auto has = [&](const std::string& name) { return std::ranges::find(names, name) != names.end(); };
  std::vector<int> numbers;
  for (const int reserved : {kFocusName, kFNumberName, kExtensionName, kDepthName}) {
    if (has(Spelled(request, {reserved}).front())) numbers.push_back(reserved);
  }
  for (std::size_t i = 0; i < request.limits.size(); ++i) {
    if (has(request.limits[i].name)) numbers.push_back(static_cast<int>(i));
  }
  return numbers;
}

}  // namespace lensd::optics
