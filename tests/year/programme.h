// What people and programs ask of lenses: calls of the right types, drawn from a seed.
#pragma once

#include <optional>
#include <string>

#include "client.h"
#include "machine.h"

namespace lensd::year {

/// One visitor's mind: which lens it works with, what it knows.
struct Mind {
  std::string lens;
  std::string lease;      ///< key that it was given
  std::string must_home;  ///< it was told that this lens is not homed
  std::string latched;    ///< it was told that this lens is stopped for good
};

/// The next call of a client of that role.
Call NextCall(Chance& chance, Role role, Mind& mind);
std::string AnyLens(Chance& chance);

}  // namespace lensd::year
