// How inputs that are text change from run to run, beside what libFuzzer does with bytes: a piece of text is repeated,
// up to the longest input, which is how nesting gets deep, and a number becomes one on an edge, which no flipped bit
// does.
#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <string_view>

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);

namespace {

using Random = std::minstd_rand;

std::size_t Below(Random& random, std::size_t end) {
  return std::uniform_int_distribution<std::size_t>(0, end - 1)(random);
}

/// The text with a few characters of it again and again where they stood: as often a few times as many thousand.
std::string Repeated(std::string_view text, std::size_t most, Random& random) {
  constexpr std::size_t kLongestPiece = 8;
  const std::size_t at = Below(random, text.size());
  const std::size_t piece = 1 + Below(random, std::min(kLongestPiece, text.size() - at));
  const std::size_t room = (most - text.size()) / piece;
  std::size_t times = std::size_t{1} << Below(random, 20);
  times = std::min(times, room);
  std::string longer(text.substr(0, at));
  for (std::size_t i = 0; i < times; ++i) longer += text.substr(at, piece);
  return longer += text.substr(at);
}

/// The text with one of its numbers on an edge.
std::string OnEdge(std::string_view text, Random& random) {
  constexpr std::array<std::string_view, 16> kEdges = {"0",
                                                       "-0.0",
                                                       "4.9e-324",
                                                       "-4.9e-324",
                                                       "2.3e-308",
                                                       "1e-300",
                                                       "1.7e308",
                                                       "-1.7e308",
                                                       "1e300",
                                                       "nan",
                                                       "9223372036854775807",
                                                       "-9223372036854775808",
                                                       "18446744073709551616",
                                                       "1e-9",
                                                       "inf",
                                                       "4294967296"};
  const auto part_of_number = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0 || c == '.'; };
  const std::size_t from = Below(random, text.size());
  const auto begin = std::find_if(text.begin() + static_cast<std::ptrdiff_t>(from), text.end(), part_of_number);
  const auto end = std::find_if_not(begin, text.end(), part_of_number);
  return std::string(text.begin(), begin).append(kEdges[Below(random, kEdges.size())]).append(end, text.end());
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, unsigned seed) {
  Random random(seed);
  const std::size_t how = Below(random, 4);
  if (size == 0 || size >= most || how > 1) return LLVMFuzzerMutate(data, size, most);
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::string changed = how == 0 ? Repeated(text, most, random) : OnEdge(text, random);
  const std::size_t length = std::min(changed.size(), most);
  std::memcpy(data, changed.data(), length);
  return length;
}
