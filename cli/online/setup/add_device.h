// The device of a new lens: found, or named by options.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/result.h"
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

/// A question about a lens, and the option that answers it beforehand.
struct Question {
  const char *option, *text, *example;
};
/// The line of TOML that `line_of` makes of `given`, or of the person's answer where that is empty; empty: not known. A
/// person is asked again where the answer cannot be read, three times in all. Usage: nobody is there, or the answers
/// ended.
std::expected<std::string, Failure> AnsweredLine(const Session& session, const std::string& given,
                                                 const Question& question,
                                                 const std::function<Result<std::string>(const std::string&)>& line_of);

/// The device of a new lens.
struct AddedDevice {
  std::string name;  ///< to propose for the lens
  bool takes_pictures = false;
  bool reports_pixel = true;  ///< its camera says how large a pixel is; a webcam does not
};
/// Device, bus, drives and camera of the lens, out of the found `devices`.
std::expected<AddedDevice, Failure> AddDevice(const Session& session, const AddOptions& options,
                                              const varlink::Json& devices, NewLens& lens);
/// The size of a pixel, where the option says it, or the camera does not report it and a person is there to say it.
std::expected<void, Failure> AddPixel(const Session& session, const AddOptions& options, const AddedDevice& device,
                                      NewLens& lens);

}  // namespace lensd::cli
