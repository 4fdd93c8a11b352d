// Circles, depth, cost and lengths of a description's references.
#include "description_check.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "description.h"

namespace lensd::drivers::aravis {
namespace {

constexpr std::size_t kMostReferences = 100;  ///< that follow one another; cameras have ten or so
constexpr std::size_t kLongestFormula = 16'384;
constexpr long long kLongestRegister = 65'536;
constexpr std::size_t kMostNamesakes = 16;  ///< nodes of one name; the standard allows one
constexpr std::size_t kLongestName = 64;    ///< that a message shows

// What evaluating takes, in microseconds: a register asks the camera, 512 bytes at a time.
constexpr double kNodeCost = 2.0, kRegisterCost = 100.0, kCharacterCost = 0.1;
constexpr double kHighestCost = 250e3;
constexpr long long kBlock = 512;

std::string Shown(const DescriptionNode& node) {
  if (node.name.empty()) return node.element;
  return node.name.size() <= kLongestName ? node.name : node.name.substr(0, kLongestName) + "...";
}

bool IsRegister(const DescriptionNode& node) {
  return node.element.ends_with("Reg") || node.element == "Register";
}

/// As Aravis reads numbers: what is none is 0.
long long NumberOf(const std::string& text) {
  return std::strtoll(text.c_str(), nullptr, 0);
}

/// Pieces of a formula that may be names.
template <class Visit>
void ForEachName(std::string_view formula, Visit visit) {
  const auto in_name = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '.'; };
  for (std::size_t i = 0; i < formula.size();) {
    std::size_t end = i;
    while (end < formula.size() && in_name(formula[end])) ++end;
    if (end > i) visit(formula.substr(i, end - i));
    i = std::max(end, i + 1);
  }
}

/// The references of all nodes, by number.
class Graph {
 public:
  explicit Graph(const Description& description) : nodes_(description.nodes), visits_(nodes_.size()) {
    // Aravis takes the last node of a name that stands where it looks for nodes; here each of them counts.
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      if (!nodes_[i].name.empty()) named_[nodes_[i].name].push_back(i);
    }
  }

  Result<void> Check() {
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      for (const auto check : {&Graph::CheckName, &Graph::CheckFormulas, &Graph::CheckLength}) {
        if (auto good = (this->*check)(nodes_[i]); !good) return good;
      }
    }
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      if (auto good = Follow(i); !good) return good;
    }
    // Only now what every value takes is known.
    for (const std::size_t i : finished_) {
      if (auto good = CheckCost(i); !good) return good;
    }
    return {};
  }

 private:
  struct Visit {
    enum { NotYet, OnTheWay, Done } state = NotYet;
    std::size_t depth = 0;      ///< references that follow one another from here
    double value_cost = 0.0;    ///< of reading its value
    double highest_cost = 0.0;  ///< of all that may be asked of it
  };
  struct Step {
    std::size_t node;
    std::vector<std::size_t> targets;
    std::size_t next = 0;
  };

  std::span<const std::size_t> Named(const std::string& name) const {
    const auto found = named_.find(name);
    return found == named_.end() ? std::span<const std::size_t>{} : found->second;
  }

  /// Nodes that are evaluated with the value of this one, as often as they are.
  std::vector<std::size_t> TargetsOf(const DescriptionNode& node) const {
    std::vector<std::size_t> targets = node.inside;
    for (const DescriptionReference& reference : node.references) {
      if (reference.kind == ReferenceKind::Aside) continue;
      for (const std::size_t target : Named(reference.name)) targets.push_back(target);
    }
    return targets;
  }

  /// Depth first, without recursion of our own.
  Result<void> Follow(std::size_t first) {
    if (visits_[first].state != Visit::NotYet) return {};
    std::vector<Step> way;
    Enter(way, first);
    while (!way.empty()) {
      Step& step = way.back();
      if (step.next == step.targets.size()) {
        Leave(step);
        way.pop_back();
        continue;
      }
      const std::size_t target = step.targets[step.next++];
      if (visits_[target].state == Visit::OnTheWay) return Circle(way, target);
      if (visits_[target].state == Visit::Done) {
        if (way.size() + visits_[target].depth > kMostReferences) return TooDeep(way);
        continue;
      }
      if (way.size() >= kMostReferences) return TooDeep(way);
      Enter(way, target);
    }
    return {};
  }

  void Enter(std::vector<Step>& way, std::size_t node) {
    visits_[node].state = Visit::OnTheWay;
    way.push_back({.node = node, .targets = TargetsOf(nodes_[node]), .next = 0});
  }

  void Leave(const Step& step) {
    Visit& visit = visits_[step.node];
    visit.value_cost = OwnCost(nodes_[step.node]);
    for (const std::size_t target : step.targets) {
      visit.depth = std::max(visit.depth, visits_[target].depth);
      visit.value_cost += visits_[target].value_cost;
    }
    ++visit.depth;
    visit.state = Visit::Done;
    finished_.push_back(step.node);
  }

  double OwnCost(const DescriptionNode& node) const {
    double cost = kNodeCost + kCharacterCost * static_cast<double>(FormulaLength(node));
    if (!IsRegister(node)) return cost;
    const long long blocks = (LengthOf(node).value_or(1) + kBlock - 1) / kBlock;
    return cost + kRegisterCost * static_cast<double>(std::clamp(blocks, 1LL, kLongestRegister));
  }

  /// Limits and conditions; and what is handed on: a converter asks for both limits behind it to tell one of its own.
  Result<void> CheckCost(std::size_t number) {
    const DescriptionNode& node = nodes_[number];
    Visit& visit = visits_[number];
    visit.highest_cost = visit.value_cost;
    const double times = node.element.ends_with("Converter") ? 2.0 : 1.0;
    for (const DescriptionReference& reference : node.references) {
      for (const std::size_t target : Named(reference.name)) {
        if (reference.kind == ReferenceKind::PValue) visit.highest_cost += times * visits_[target].highest_cost;
        if (reference.kind == ReferenceKind::Aside) visit.highest_cost += visits_[target].value_cost;
      }
    }
    // The conditions of an enumeration's entries.
    for (const std::size_t inside : node.inside) visit.highest_cost += visits_[inside].highest_cost;
    if (visit.highest_cost <= kHighestCost) return {};
    return Fail(Code::BadData, "makes the camera answer thousands of questions for \"" + Shown(node) +
                                   "\" alone: its references branch out too far");
  }

  Result<void> Circle(const std::vector<Step>& way, std::size_t target) const {
    constexpr std::size_t kMostShown = 8;
    std::size_t from = 0;
    while (way[from].node != target) ++from;
    const std::size_t count = way.size() - from;
    std::string chain;
    for (std::size_t i = 0; i < std::min(count, kMostShown); ++i) chain += Shown(nodes_[way[from + i].node]) + " -> ";
    if (count > kMostShown) chain += "(" + std::to_string(count - kMostShown) + " more) -> ";
    return Fail(Code::BadData, "has nodes that refer to each other in a circle: " + chain + Shown(nodes_[target]));
  }

  Result<void> TooDeep(const std::vector<Step>& way) const {
    return Fail(Code::BadData, "has more than " + std::to_string(kMostReferences) +
                                   " references that follow one another, beginning with \"" +
                                   Shown(nodes_[way.front().node]) + "\"");
  }

  /// Aravis adds nodes of such names that the file does not have, and which refer to each other.
  Result<void> CheckName(const DescriptionNode& node) {
    if (node.name.starts_with("ArvGev")) {
      return Fail(Code::BadData, "names a node \"" + Shown(node) + "\", a name that Aravis has for nodes of its own");
    }
    const std::size_t namesakes = Named(node.name).size();
    if (namesakes <= kMostNamesakes) return {};
    return Fail(Code::BadData, "has " + std::to_string(namesakes) + " nodes of the name \"" + Shown(node) + "\"");
  }

  Result<void> CheckFormulas(const DescriptionNode& node) {
    const std::size_t length = FormulaLength(node);
    if (length <= kLongestFormula) return {};
    return Fail(Code::BadData, "has formulas of " + std::to_string(length) + " characters at \"" + Shown(node) +
                                   "\", more than lensd accepts (" + std::to_string(kLongestFormula) + ")");
  }

  /// With each part that has a name put in where the name stands; Aravis does this once, not in the parts themselves.
  static std::size_t FormulaLength(const DescriptionNode& node) {
    std::unordered_map<std::string_view, std::size_t> parts;
    std::size_t length = 0;
    for (std::size_t i = 0; i < node.expressions.size(); ++i) {
      parts[node.expression_names[i]] = node.expressions[i].size();
      length += node.expressions[i].size();
    }
    for (const std::string& formula : node.formulas) {
      length += formula.size();
      if (parts.empty()) continue;
      ForEachName(formula, [&](std::string_view name) {
        if (const auto part = parts.find(name); part != parts.end()) length += part->second;
      });
    }
    return length;
  }

  /// Aravis makes room for as many bytes as a register is said to have, and ends the process where there are not as
  /// many. A length that the camera tells while it runs cannot be checked here.
  Result<void> CheckLength(const DescriptionNode& node) {
    // Nobody reads a plain Register: they are large, for files and tables.
    if (!IsRegister(node) || node.element == "Register") return {};
    const auto length = LengthOf(node);
    if (!length) {
      return Fail(Code::BadData, "lets \"" + node.length_reference + "\" say how long \"" + Shown(node) +
                                     "\" is, which is no constant");
    }
    if (*length >= 0 && *length <= kLongestRegister) return {};
    return Fail(Code::BadData, "says that \"" + Shown(node) + "\" has " + std::to_string(*length) +
                                   " bytes; lensd accepts 0 to " + std::to_string(kLongestRegister));
  }

  /// None: it is not constant.
  std::optional<long long> LengthOf(const DescriptionNode& node) const {
    if (node.length_reference.empty()) return node.length.empty() ? 4 : NumberOf(node.length);
    const auto targets = Named(node.length_reference);
    if (targets.empty()) return NumberOf(node.length_reference);
    long long longest = 0;
    for (const std::size_t target : targets) {
      const DescriptionNode& stated = nodes_[target];
      const bool constant = stated.element == "Integer" && !stated.constant.empty() &&
                            std::ranges::all_of(stated.references, [](const DescriptionReference& reference) {
                              return reference.kind == ReferenceKind::Aside;
                            });
      if (!constant) return std::nullopt;
      const long long bytes = NumberOf(stated.constant);
      if (bytes < 0) return bytes;
      longest = std::max(longest, bytes);
    }
    return longest;
  }

  const std::vector<DescriptionNode>& nodes_;
  std::unordered_map<std::string, std::vector<std::size_t>> named_;
  std::vector<Visit> visits_;
  std::vector<std::size_t> finished_;  ///< each after those that its value needs
};

}  // namespace

Result<void> CheckDescription(std::string_view text) {
  const auto description = ReadDescription(text);
  if (!description) return PassOn(description);
  return Graph(*description).Check();
}

}  // namespace lensd::drivers::aravis
