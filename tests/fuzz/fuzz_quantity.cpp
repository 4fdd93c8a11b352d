// Everything that reads a quantity: accepted numbers are finite, and ranges are in order.
#include "cli/quantity.h"

#include <cmath>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lensd::cli;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (const auto length = ParseLength(text, "x"); length && !std::isfinite(length->value)) __builtin_trap();
  if (const auto depth = ParseDepth(text, "x"); depth && !std::isfinite(depth->value)) __builtin_trap();
  if (const auto range = ParseDepthRange(text, "x"); range && range->near.Vergence() < range->far.Vergence())
    __builtin_trap();
  if (const auto stops = ParseFNumbers(text, "x"); stops && !(stops->range.low.value > 0)) __builtin_trap();
  if (const auto span = ParseLengthRange(text, "x"); span && span->low > span->high) __builtin_trap();
  (void)ParsePercent(text, "x");
  (void)ParseTime(text, "x");
  (void)IsQuantity(text);
  return 0;
}
