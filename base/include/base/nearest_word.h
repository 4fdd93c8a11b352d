// What a user may have meant by a word that is not in a list.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace lensd {

/// The one of `words` that `typed` most likely stands for: the only one it begins, or the nearest by letters left out,
/// added, exchanged or swapped with their neighbour (Damerau's distance), one for every three letters of `typed`.
/// Nothing where two are equally near or none is near enough.
std::optional<std::string> NearestWord(std::string_view typed, std::span<const std::string> words);

}  // namespace lensd
