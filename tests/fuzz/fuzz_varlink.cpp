// A connection's bytes as they arrive in pieces; what is accepted must be writable and read back the same.
#include "varlink/frame.h"
#include "varlink/json.h"
#include "varlink/message.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::size_t piece = data[0] % 64 + 1;
  lensd::varlink::FrameReader reader;
  for (std::size_t from = 1; from < size; from += piece) {
    reader.Append({reinterpret_cast<const char*>(data) + from, std::min(piece, size - from)});
    for (;;) {
      const auto message = reader.Next();
      if (!message || !*message) break;
      const auto call = lensd::varlink::ReceiveCall(**message);
      if (!call) return 0;
      const lensd::varlink::Json parameters = call->parameters.ToJson();
      const auto again = lensd::varlink::ParseJson(lensd::varlink::WriteJson(parameters));
      if (!again || *again != parameters) __builtin_trap();
    }
  }
  return 0;
}
