// A connection's bytes as they arrive in pieces; what is accepted must be writable and read back the same.
#include "proto/frame.h"
#include "proto/json.h"
#include "proto/message.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::size_t piece = data[0] % 64 + 1;
  lensd::proto::FrameReader reader;
  for (std::size_t from = 1; from < size; from += piece) {
    reader.Append({reinterpret_cast<const char*>(data) + from, std::min(piece, size - from)});
    for (;;) {
      const auto message = reader.Next();
      if (!message || !*message) break;
      const auto call = lensd::proto::ParseCall(**message);
      if (!call) return 0;
      const auto again = lensd::proto::ParseJson(lensd::proto::WriteJson(call->parameters));
      if (!again || *again != call->parameters) __builtin_trap();
    }
  }
  return 0;
}
