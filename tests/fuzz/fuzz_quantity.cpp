// Everything that reads a quantity: accepted numbers are finite, and ranges are in order.
#include "cli/text/quantity.h"

#include <cmath>

#include "cli/plan/where.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lensd::cli;
  using lensd::optics::LimitKind;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (const auto length = ParseLength(text, "x"); length && !std::isfinite(length->value)) __builtin_trap();
  if (const auto depth = ParseDepth(text, "x"); depth && !std::isfinite(depth->Vergence().value)) __builtin_trap();
  if (const auto range = ParseDepthRange(text, "x"); range && range->near.Vergence() < range->far.Vergence())
    __builtin_trap();
  if (const auto stops = ParseFNumbers(text, "x"); stops && !stops->range.low.IsPositive()) __builtin_trap();
  if (const auto span = ParseLengthRange(text, "x"); span && span->high < span->low) __builtin_trap();
  for (const LimitKind kind : {LimitKind::Sharp, LimitKind::Blurred}) {
    const auto limit = ParseLimit(text, kind);
    if (limit && limit->limit && !limit->limit->value.IsPositive()) __builtin_trap();
  }
  (void)ParseDiameters(text, "x");
  (void)ParsePercent(text, "x");
  (void)ParseTime(text, "x");
  return 0;
}
