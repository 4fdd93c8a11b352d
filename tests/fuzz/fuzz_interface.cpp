// Text that parses as an interface definition is kept word for word.
#include "varlink/interface_definition.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto parsed = lensd::varlink::InterfaceDefinition::Parse(text);
  if (parsed && parsed->text() != text) __builtin_trap();
  return 0;
}
