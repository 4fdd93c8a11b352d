// What every refusal says that a lens meets because its optics are not known.
#pragma once

#include <string>

namespace lensd {

/// What to configure, and the page that explains it: the end of a message.
inline constexpr const char* kConfigureOptics =
    "give [lens.optics] its focal_length_mm, f_number and closest_m, or name the lens with optics = \"MODEL\" "
    "(docs/lenses.md)";

/// "WHAT is not known: give [lens.optics] ..."; `what` with its verb, as "the optics of this lens are".
inline std::string OpticsMissing(const std::string& what) {
  return what + " not known: " + kConfigureOptics;
}

}  // namespace lensd
