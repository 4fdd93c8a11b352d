// The device of a new lens: found, or named by options.
#pragma once

#include <string>
#include <vector>

#include "cli/online/setup/lens_file.h"
#include "cli/terminal/session.h"
#include "varlink/json.h"

namespace lensd::cli {

struct AddOptions {
  int number = 0;  ///< of the device, from 1; 0: left out
  int camera = 0;  ///< of the device that takes the pictures
  std::string name, driver, bus, model, focal_length, f_number, closest, closest_from, pixel, direction;
  std::vector<std::string> keys, drives;
};

inline constexpr const char* kUnknown = "unknown";

/// A person at a terminal, who is asked; a script gives all by options.
bool SomebodyIsThere(const Session& session);

/// Device, bus, drives and camera of the lens, out of the found `devices`. Returns the name to propose.
std::expected<std::string, Failure> AddDevice(const Session& session, const AddOptions& options,
                                              const varlink::Json& devices, NewLens& lens);

}  // namespace lensd::cli
