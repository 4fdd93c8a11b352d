// lensd.toml: what is refused names the file, and what is accepted means the same when it is read again.
#include <cstddef>
#include <cstdint>
#include <string>

#include "daemon/config/config.h"
#include "daemon/methods/lenses.h"
#include "memory_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lensd;
  const fuzz::MemoryFile file(data, size);
  const auto config = daemon::ReadConfig(file.path());
  if (!config) {
    if (config.error().message.find(file.path()) == std::string::npos) __builtin_trap();
    return 0;
  }
  if (const auto checked = daemon::CheckAll(*config); !checked && checked.error().message.empty()) __builtin_trap();
  const auto again = daemon::ReadConfig(file.path());
  if (!again || again->lenses.size() != config->lenses.size()) __builtin_trap();
  for (std::size_t i = 0; i < config->lenses.size(); ++i) {
    if (config->lenses[i].name.empty()) __builtin_trap();
    if (!daemon::SameLens(config->lenses[i], again->lenses[i])) __builtin_trap();
    for (std::size_t j = 0; j < i; ++j) {
      if (config->lenses[i].name == config->lenses[j].name) __builtin_trap();
    }
  }
  return 0;
}
