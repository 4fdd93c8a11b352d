// Names that no client can guess and that no other run makes again.
#pragma once

#include <array>
#include <cstdio>
#include <random>
#include <string>

namespace lensd::daemon {

/// 16 hexadecimal digits.
inline std::string RandomName() {
  std::random_device random;
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%08x%08x", random(), random());
  return text.data();
}

}  // namespace lensd::daemon
