// Profiles of Modbus drives and the numbers in their registers: a profile that is accepted can write its target, reads
// back what it wrote, and has words for every alarm.
#include <algorithm>
#include <cstdint>
#include <limits>
#include <string_view>
#include <vector>

#include "io/toml.h"
#include "profile.h"

namespace {

using namespace lensd;
using namespace lensd::drivers::modbus;

void Numbers(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 6) return;
  const auto type = static_cast<NumberType>(bytes[0] % 4);
  const auto order = static_cast<WordOrder>(bytes[1] % 2);
  const std::uint16_t words[2] = {static_cast<std::uint16_t>(bytes[2] << 8 | bytes[3]),
                                  static_cast<std::uint16_t>(bytes[4] << 8 | bytes[5])};
  const std::int64_t number = NumberAt(words, type, order);
  if (!Fits(type, number)) __builtin_trap();
  std::vector<std::uint16_t> written;
  AppendNumber(written, type, order, number);
  if (!std::ranges::equal(written, std::span(words).first(static_cast<std::size_t>(RegistersOf(type)))))
    __builtin_trap();
}

void Profiles(std::string_view text, std::int64_t target) {
  const auto table = io::ParseToml(text, "fuzz");
  if (!table) return;
  const auto profile = ReadProfile(*table);
  if (!profile) return;
  for (const WriteStep& step : profile->move) {
    const auto registers = RegistersOf(step, *profile, target);
    std::size_t words = 0;
    for (const Field& field : step.fields) words += static_cast<std::size_t>(RegistersOf(field.type));
    if (registers && registers->size() != words) __builtin_trap();
  }
  (void)AlarmText(*profile, target);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  if (data[0] == 0) {
    Numbers({data + 1, size - 1});
    return 0;
  }
  constexpr std::int64_t kTargets[] = {0, -1, 65'536, std::numeric_limits<std::int64_t>::min(),
                                       std::numeric_limits<std::int64_t>::max()};
  Profiles({reinterpret_cast<const char*>(data) + 1, size - 1}, kTargets[data[0] % 5]);
  return 0;
}
