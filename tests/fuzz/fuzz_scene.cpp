// TOML and the scene's own rules in one go: a refusal must name the file.
#include "memory_file.h"
#include "sim/scene.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const lensd::fuzz::MemoryFile file(data, size);
  const auto scene = lensd::sim::LoadScene(file.path());
  if (!scene && scene.error().message.find(file.path()) == std::string::npos) __builtin_trap();
  return 0;
}
