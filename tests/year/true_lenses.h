// The lenses of the year: simulated ones that outlive every lensd that drives them, as real ones do.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/clock.h"
#include "drivers/api/device.h"
#include "machine.h"
#include "sim/world.h"

namespace lensd::year {

/// Faults planted on purpose, to see that they are found.
struct Planted {
  bool backlash_hidden = false;  ///< the driver says there is none: bounds are too small
  bool stop_ignored = false;     ///< the driver takes a stop and does nothing
  bool lease_late = false;       ///< leases last longer than was asked
  bool disk_lies = false;        ///< fsync() of a file does nothing
};

/// One lens and what is true of it. Shared by the driver's calls and the tests: one thread runs at a time.
struct TrueLens {
  std::string name;
  sim::World world;
  drivers::PerAxis<std::int64_t> doubtful_until{};  ///< ns; what no readback shows has happened to the axis
  drivers::PerAxis<std::int64_t> frozen_until{};    ///< its readings repeat what was
  std::int64_t troubled_until = 0;                  ///< a fault is or was in force until then
  std::int64_t hang = 0;                            ///< the next question takes so long
  std::uint64_t opened = 0;

  /// Where the mechanism of an axis was.
  std::optional<double> PlaceAt(drivers::Axis axis, std::int64_t at) const;
  bool MovesNow(drivers::Axis axis) const;
};

/// Lens 3 is "l03".
std::string LensName(std::uint64_t number);

class Lenses {
 public:
  static constexpr std::size_t kCount = 16;
  /// Writes lensd.toml and its scenes into the folder we are in.
  Lenses(const Clock& clock, const Planted& planted);

  TrueLens& operator[](const std::string& name) { return *lenses_.at(name); }
  const std::map<std::string, std::unique_ptr<TrueLens>>& all() const { return lenses_; }
  /// As a driver opens it.
  drivers::Device Open(const std::string& name);
  const Planted& planted() const { return planted_; }
  /// Something goes wrong with one of them: what, for the trace.
  std::string Trouble(Chance& chance);

 private:
  const Clock& clock_;
  const Planted planted_;
  std::map<std::string, std::unique_ptr<TrueLens>> lenses_;
};

}  // namespace lensd::year
