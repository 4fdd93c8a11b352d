// The nodes of a camera's GenICam description and what they refer to, as the XML has them.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace lensd::drivers::aravis {

/// When Aravis follows a reference.
enum class ReferenceKind {
  Value,   ///< whenever the node's value is read: pVariable, pAddress, pIndex and so on
  PValue,  ///< then too, and where the node's limits, access mode or a write are handed on to what it points to
  Aside,   ///< for limits and conditions of the node alone: pMin, pMax, pInc, pIsAvailable and so on
};

struct DescriptionReference {
  ReferenceKind kind = ReferenceKind::Value;
  std::string name;  ///< of the node that is meant
};

/// One node: an element that may be evaluated, with what its own elements say.
struct DescriptionNode {
  std::string element;  ///< "IntReg"
  std::string name;     ///< empty: it has none
  std::vector<DescriptionReference> references;
  std::vector<std::size_t> inside;  ///< nodes that stand inside of this one and are evaluated with it
  std::vector<std::string> formulas;
  std::vector<std::string> expression_names, expressions;  ///< parts of formulas, by name
  std::string length;                                      ///< of a register, as it is written; empty: not given
  std::string length_reference;                            ///< the node that states its length; empty: none
  std::string constant;                                    ///< its <Value>; empty: none
};

struct Description {
  std::vector<DescriptionNode> nodes;
};

/// Reads `text`, and skips what stands after the end of the XML. Pure; from any thread. BadData: this is no GenICam
/// description, it is larger than lensd accepts, or its XML is broken; the message continues "its GenICam file ".
Result<Description> ReadDescription(std::string_view text);

}  // namespace lensd::drivers::aravis
