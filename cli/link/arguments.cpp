// Names and values of the commands for one lens: a word that reads as a quantity or an axis is not a name.
#include "cli/link/arguments.h"

#include <algorithm>
#include <array>

#include "cli/text/quantity.h"

namespace lensd::cli {

NameAndValue SplitNameAndValue(const std::vector<std::string>& words) {
  if (words.size() == 2) return {words[0], words[1]};
  return {nullptr, words.empty() ? "" : words[0]};
}

std::optional<std::string> MeantByTwoWords(const std::vector<std::string>& words, std::string_view command,
                                           const std::function<bool(std::string_view)>& reads) {
  if (words.size() != 2) return std::nullopt;
  const std::string begin = "write lensctl " + std::string(command) + " ";
  if (ParseNumber(words[0], "") && reads(words[0] + words[1])) {
    return "'" + words[0] + " " + words[1] + "': a number and its unit are one word; " + begin + words[0] + words[1];
  }
  if (reads(words[1]) || !reads(words[0])) return std::nullopt;
  return "'" + words[0] + " " + words[1] + "': the name of the lens stands first; " + begin + words[1] + " " + words[0];
}

bool IsAxis(std::string_view word) {
  constexpr std::array<std::string_view, 4> kAxes = {"focus", "iris", "zoom", "filter"};
  return std::ranges::find(kAxes, word) != kAxes.end();
}

std::string UnknownAxis(const std::string& word) {
  return "there is no axis '" + word + "': the axes are focus, iris, zoom and filter";
}

varlink::Json LensOf(const std::string& name) {
  return name.empty() ? varlink::Json(nullptr) : varlink::Json(name);
}

Result<varlink::Json> ParseRegion(std::string_view text, const std::string& option) {
  constexpr const char* kKeys[] = {"x", "y", "w", "h"};
  const std::string whole(text);
  varlink::Json region = varlink::Json::object();
  for (std::size_t i = 0; i < std::size(kKeys); ++i) {
    const std::size_t comma = text.find(',');
    if ((comma == text.npos) != (i + 1 == std::size(kKeys))) {
      return Fail(Code::InvalidArgument, option + ": say X,Y,W,H as fractions of the frame, such as 0.4,0.4,0.2,0.2");
    }
    auto number = ParseNumber(text.substr(0, comma), option);
    if (!number) return PassOn(number);
    region[kKeys[i]] = *number->Nearest();
    text.remove_prefix(comma == text.npos ? text.size() : comma + 1);
  }
  const auto large = [](const varlink::Json& number) { return number.get<double>() > 1.0; };
  if (large(region["w"]) || large(region["h"])) {
    return Fail(Code::InvalidArgument,
                option + " '" + whole +
                    "': these are pixels; write fractions of the frame: X and W divided by its width, Y and H by its "
                    "height, such as 0.4,0.4,0.2,0.2 for 256,192,128,96 of 640 x 480 px");
  }
  const auto inside = [&](const char* from, const char* size) {
    constexpr double kRounding = 1e-9;  // as the daemon has it
    const double start = region[from].get<double>(), share = region[size].get<double>();
    return start >= 0.0 && share > 0.0 && start + share <= 1.0 + kRounding;
  };
  if (!inside("x", "w") || !inside("y", "h")) {
    return Fail(Code::InvalidArgument,
                option + ": it is not within the frame: W and H are above 0, X + W and Y + H at most 1");
  }
  return region;
}

}  // namespace lensd::cli
