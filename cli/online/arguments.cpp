#include "cli/online/arguments.h"

namespace lensd::cli {

NameAndValue SplitNameAndValue(const std::vector<std::string>& words) {
  if (words.size() == 2) return {words[0], words[1]};
  return {nullptr, words.empty() ? "" : words[0]};
}

proto::Json LensOf(const std::string& name) {
  return name.empty() ? proto::Json(nullptr) : proto::Json(name);
}

}  // namespace lensd::cli
