// GenICam descriptions, and zip files of them: any bytes are accepted, or refused with a reason, and the same bytes in
// the same way.
#include <cstdint>
#include <string_view>

#include "description_check.h"
#include "packed_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto first = lensd::drivers::aravis::CheckDescription(text),
             again = lensd::drivers::aravis::CheckDescription(text);
  if (first.has_value() != again.has_value()) __builtin_trap();
  if (const auto packed = lensd::drivers::aravis::CheckPackedFile(text); !packed && packed.error().message.empty()) {
    __builtin_trap();
  }
  if (first) return 0;
  if (first.error().message.empty() || first.error().message != again.error().message) __builtin_trap();
  return 0;
}
