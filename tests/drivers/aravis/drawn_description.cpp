// Works on the text, with nothing of the product: finds where nodes begin and end, and writes references into them.
#include "drawn_description.h"

#include <algorithm>
#include <functional>
#include <iterator>
#include <random>
#include <regex>
#include <string_view>
#include <utility>
#include <vector>

namespace lensd::testing {
namespace {

constexpr const char* kKinds[] = {"pValue",         "pMin",      "pMax",         "pInc",          "pIsAvailable",
                                  "pIsImplemented", "pIsLocked", "pVariable",    "pAddress",      "pLength",
                                  "pIndex",         "pOffset",   "pPort",        "pCommandValue", "pValueIndexed",
                                  "pValueDefault",  "pSelected", "pInvalidator", "pFeature",      "IntSwissKnife",
                                  "SwissKnife",     "EnumEntry", "StructEntry",  "Expression",    "Formula"};
constexpr const char* kNodes[] = {"Integer", "IntSwissKnife", "Converter", "IntConverter", "SwissKnife", "Float",
                                  "IntReg",  "MaskedIntReg",  "StringReg", "FloatReg",     "StructReg",  "Boolean",
                                  "Command", "Enumeration",   "Port",      "Category"};

constexpr std::size_t kMostNodes = 3000;

struct Node {
  std::string element, name;
  std::size_t begin = 0, end = 0;  ///< of what stands inside
};

class Draw {
 public:
  Draw(std::string text, std::uint64_t seed) : text_(std::move(text)), random_(seed) {}

  std::string Make() {
    using Change = void (Draw::*)();
    constexpr Change kChanges[] = {&Draw::Everyone, &Draw::Everyone, &Draw::Few,   &Draw::Few,
                                   &Draw::Retarget, &Draw::Rekind,   &Draw::Chain, &Draw::Chain,
                                   &Draw::Numbers,  &Draw::Bytes,    &Draw::Divide};
    const std::size_t times = Below(8) == 0 ? 0 : 1 + Below(2);
    for (std::size_t i = 0; i < times; ++i) {
      FindNodes();
      if (nodes_.size() < 2 || nodes_.size() > kMostNodes) break;
      (this->*kChanges[Below(std::size(kChanges))])();
    }
    return text_;
  }

 private:
  std::size_t Below(std::size_t count) { return std::uniform_int_distribution<std::size_t>(0, count - 1)(random_); }
  bool Once(double chance) { return std::bernoulli_distribution(chance)(random_); }
  const Node& Any() { return nodes_[Below(nodes_.size())]; }

  void FindNodes() {
    static const std::regex opening("<([A-Z][A-Za-z]*) Name=\"([^\"]*)\"[^>/]*>");
    nodes_.clear();
    for (std::sregex_iterator match(text_.begin(), text_.end(), opening), none; match != none; ++match) {
      Node node{.element = (*match)[1], .name = (*match)[2], .begin = 0, .end = 0};
      if (node.element == "EnumEntry" || node.element == "Constant" || node.element == "Expression") continue;
      node.begin = static_cast<std::size_t>(match->position()) + static_cast<std::size_t>(match->length());
      node.end = text_.find("</" + node.element + ">", node.begin);
      if (node.end != std::string::npos) nodes_.push_back(std::move(node));
    }
  }

  /// One reference, as each kind is written.
  std::string Reference(std::string_view kind, const std::string& target) {
    const std::string tag(kind), value = "<Value>" + std::to_string(Below(9)) + "</Value>";
    const std::string variable = "<pVariable Name=\"V\">" + target + "</pVariable>";
    if (kind == "pVariable") return "<pVariable Name=\"V" + std::to_string(Below(4)) + "\">" + target + "</pVariable>";
    if (kind == "pOffset") return "<pIndex pOffset=\"" + target + "\">" + Any().name + "</pIndex>";
    if (kind == "pValueIndexed") return "<pValueIndexed Index=\"0\">" + target + "</pValueIndexed>";
    if (kind == "IntSwissKnife" || kind == "SwissKnife") {
      return "<" + tag + " Name=\"In" + target + "\">" + variable + "<Formula>V + 1</Formula></" + tag + ">";
    }
    if (kind == "EnumEntry") {
      return "<EnumEntry Name=\"" + target + "\">" + value + "<pIsAvailable>" + target + "</pIsAvailable><pValue>" +
             target + "</pValue></EnumEntry>";
    }
    if (kind == "StructEntry") {
      return "<StructEntry Name=\"In" + target + "\"><pIsAvailable>" + target +
             "</pIsAvailable><Bit>3</Bit></StructEntry>";
    }
    if (kind == "Expression") return "<Expression Name=\"V\">V + " + target + "</Expression>" + variable;
    return "<" + tag + ">" + target + "</" + tag + ">";
  }

  using Additions = std::vector<std::pair<std::size_t, std::string>>;
  void Insert(Additions additions) {
    std::ranges::sort(additions, std::greater{});  // what stands later first: places stay right
    for (const auto& [place, text] : additions) text_.insert(place, text);
  }

  /// Aravis takes some elements where they stand first, others where they stand last.
  std::size_t Place(const Node& node) { return Once(0.5) ? node.begin : node.end; }

  /// Every node refers to every other (or to all that come later, which makes no circle), by one kind.
  void Everyone() {
    const char* kind = kKinds[Below(std::size(kKinds))];
    const bool later = Once(0.5), last = Once(0.5);
    constexpr std::size_t kMostForAll = 400;  // a megabyte of references and more
    const double density = Once(0.5) && nodes_.size() <= kMostForAll ? 1.0 : 0.02;
    Additions additions;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      std::string all;
      for (std::size_t k = later ? i + 1 : 0; k < nodes_.size(); ++k) {
        if (k != i && (density == 1.0 || Once(density))) all += Reference(kind, nodes_[k].name);
      }
      additions.emplace_back(last ? nodes_[i].end : nodes_[i].begin, std::move(all));
    }
    Insert(std::move(additions));
  }

  void Few() {
    Additions additions;
    for (std::size_t i = 0, count = 1 + Below(8); i < count; ++i) {
      additions.emplace_back(Place(Any()), Reference(kKinds[Below(std::size(kKinds))], Any().name));
    }
    Insert(std::move(additions));
  }

  /// Writes the text anew, each match of `what` as `make` has it.
  template <class Make>
  void Replace(const std::regex& what, double chance, Make make) {
    std::string made;
    auto from = text_.cbegin();
    for (std::sregex_iterator match(text_.begin(), text_.end(), what), none; match != none; ++match) {
      made.append(from, text_.cbegin() + match->position());
      made += Once(chance) ? make(*match) : match->str();
      from = text_.cbegin() + match->position() + match->length();
    }
    made.append(from, text_.cend());
    text_ = std::move(made);
  }

  void Retarget() {
    static const std::regex reference("<(p[A-Z][A-Za-z]*)([^>]*)>[^<]*<");
    Replace(reference, Once(0.5) ? 0.02 : 0.3, [this](const std::smatch& match) {
      return "<" + match[1].str() + match[2].str() + ">" + Any().name + "<";
    });
  }

  void Rekind() {
    static const std::regex reference("<(p[A-Z][A-Za-z]*)[^>]*>([^<]*)</p[A-Za-z]*>");
    Replace(reference, 0.05,
            [this](const std::smatch& match) { return Reference(kKinds[Below(std::size(kKinds))], match[2].str()); });
  }

  /// New nodes of one element that hand on to the next, which end in an old one, and one that uses the first.
  void Chain() {
    const std::string element = kNodes[Below(std::size(kNodes))];
    const char* kind = kKinds[Below(std::size(kKinds))];
    const std::size_t count = 1 + Below(Once(0.3) ? 400 : 30), width = 1 + Below(2);
    const std::string end = Once(0.2) ? "Link0" : Any().name;
    std::string chain;
    for (std::size_t i = 0; i < count; ++i) {
      const std::string next = i + 1 == count ? end : "Link" + std::to_string(i + 1);
      chain += "<" + element + " Name=\"Link" + std::to_string(i) + "\">";
      for (std::size_t k = 0; k < width; ++k) chain += Reference(kind, next);
      if (Once(0.5)) chain += "<Formula>V * 2</Formula><FormulaTo>FROM</FormulaTo><FormulaFrom>TO</FormulaFrom>";
      if (Once(0.5)) chain += "<Address>0x100</Address><Length>4</Length><pPort>Device</pPort>";
      chain += "</" + element + ">\n";
    }
    Insert({{Place(Any()), Reference(kKinds[Below(std::size(kKinds))], "Link0")}});
    const std::size_t place = text_.rfind("</RegisterDescription>");
    if (place != std::string::npos) text_.insert(place, chain);
  }

  void Numbers() {
    static const std::regex number(">(0x[0-9A-Fa-f]+|-?[0-9.]+)<");
    static constexpr const char* kOdd[] = {
        "0", "-1", "-9223372036854775808", "9223372036854775807", "4294967296", "1e308", "nan", "65535", ""};
    Replace(number, 0.03, [this](const std::smatch&) { return ">" + std::string(kOdd[Below(std::size(kOdd))]) + "<"; });
  }

  /// A node that divides what is close to the ends of 64 bits, by constants or by registers, and nodes that use it.
  void Divide() {
    static constexpr const char* kOperands[] = {"(1 << 63)", "(V0 << 63)", "(0 - 1)", "V0",   "V1",
                                                "(V1 | 1)",  "V2",         "1e30",    "(~0)", "0x8000000000000000"};
    const auto operand = [&] { return std::string(kOperands[Below(std::size(kOperands))]); };
    const std::string formula = operand() + (Once(0.5) ? " / " : " % ") + operand();
    const bool converts = Once(0.3);
    const std::string element = converts ? "IntConverter" : "IntSwissKnife";
    std::string nodes = "<" + element + " Name=\"Divides\">";
    for (const char* name : {"V0", "V1", "V2"})
      nodes += "<pVariable Name=\"" + std::string(name) + "\">Divided" + name + "</pVariable>";
    nodes += converts ? "<FormulaTo>" + formula + "</FormulaTo><FormulaFrom>" + formula +
                            "</FormulaFrom><pValue>DividedV0</pValue>"
                      : "<Formula>" + formula + "</Formula>";
    nodes += "</" + element + ">";
    for (const char* name : {"V0", "V1", "V2"}) {
      nodes += "<IntReg Name=\"Divided" + std::string(name) + "\"><Address>" + std::to_string(16 * Below(4096)) +
               "</Address><Length>8</Length><AccessMode>RW</AccessMode><pPort>Device</pPort><Sign>" +
               (Once(0.8) ? "Signed" : "Unsigned") + "</Sign></IntReg>";
    }
    Insert({{Place(Any()), Reference(kKinds[Below(std::size(kKinds))], "Divides")}});
    const std::size_t place = text_.rfind("</RegisterDescription>");
    if (place != std::string::npos) text_.insert(place, nodes);
  }

  void Bytes() {
    const std::size_t what = Below(4);
    if (what == 0) text_.resize(Below(text_.size()) + 1);
    if (what == 1) {
      const std::size_t from = Below(text_.size()), size = std::min<std::size_t>(Below(2000), text_.size() - from);
      const std::string piece = text_.substr(from, size);
      text_.insert(Below(text_.size()), piece);
    }
    if (what == 2) text_.erase(Below(text_.size()), Below(500));
    if (what != 3) return;
    for (std::size_t i = 0, count = 1 + Below(20); i < count; ++i)
      text_[Below(text_.size())] = static_cast<char>(Below(256));
  }

  std::string text_;
  std::mt19937_64 random_;
  std::vector<Node> nodes_;
};

}  // namespace

std::string DrawDescription(std::span<const std::string> good, std::uint64_t seed) {
  return Draw(good[seed % good.size()], seed).Make();
}

}  // namespace lensd::testing
