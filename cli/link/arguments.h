// What the commands for one lens have in common on the command line.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cli/terminal/session.h"
#include "varlink/json.h"

namespace lensd::cli {

/// `[NAME] VALUE` as it was written: CLI11 cannot tell which of two optional words is missing.
struct NameAndValue {
  varlink::Json lens;  ///< null: left out
  std::string value;   ///< empty: left out
};
/// One word is the value, two are name and value. More are refused by the parser.
NameAndValue SplitNameAndValue(const std::vector<std::string>& words);

/// What to write instead of two words that are not `NAME VALUE`: the value stands first (`2m bike`), or one quantity
/// was written as two words (`1.2 m`). `reads` says whether a text is a value of this command. Nullopt for anything
/// else.
std::optional<std::string> MeantByTwoWords(const std::vector<std::string>& words, std::string_view command,
                                           const std::function<bool(std::string_view)>& reads);

/// Whether the word is one of the axes' names.
bool IsAxis(std::string_view word);
/// For the person who wrote it in the place of one.
std::string UnknownAxis(const std::string& word);

/// A name, or null where it was left out.
varlink::Json LensOf(const std::string& name);

/// `X,Y,W,H` as fractions of the frame, to a Region of the interface. InvalidArgument names `option`.
Result<varlink::Json> ParseRegion(std::string_view text, const std::string& option);

}  // namespace lensd::cli
