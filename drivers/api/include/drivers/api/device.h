// A device: a lens, a camera, or both behind one handle; and how drivers are registered.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/clock.h"
#include "base/settings.h"
#include "drivers/api/camera.h"
#include "drivers/api/lens.h"
#include "drivers/api/simulation.h"

namespace lensd::drivers {

/// What a driver knows of the optics of the lens it opened: a nominal calibration. Lengths in metres.
struct NominalOptics {
  double focal_length_m = 0.0;      ///< the shortest one of a zoom
  double max_focal_length_m = 0.0;  ///< the longest one, at the zoom axis' maximum; 0: it does not zoom
  double centre_shift_m = 0.0;      ///< how far the lens centre moves toward the scene from the shortest to the longest
  double min_f_number = 0.0;        ///< widest opening
  double max_f_number = 0.0;
  double min_extension_m = 0.0;  ///< extension at the focus axis' minimum
  double max_extension_m = 0.0;  ///< extension at the focus axis' maximum
  /// A liquid lens: its power changes, its sensor stays. The focal length is then the one it has focused at infinity,
  /// the sensor's distance; f-numbers are those at infinity; extensions are the sensor's distance minus the focal
  /// length, and the power is even across the focus axis.
  bool liquid = false;
  /// Iris: native minimum is min_f_number, maximum is max_f_number, even in log(f-number) between.
};

/// A part that the device lists and that cannot be used, as was found while it was opened.
struct LeftOut {
  std::string part;               ///< an axis' name, "camera" (its pictures), "exposure" or "gain"
  std::string reason;             ///< for people
  Code code = Code::Unsupported;  ///< of the error that was the reason

  bool operator==(const LeftOut&) const = default;
};

/// What was found of a device while it was opened, beside what it can do.
class Findings {
 public:
  /// The part is there and cannot be used. Of several reasons for one part the first is kept.
  void LeaveOut(std::string_view part, const Error& why);
  /// The part could be used in another way.
  void TakeBack(std::string_view part);
  /// Something is not as it should be, and costs no part.
  void Doubt(std::string what) { doubts_.push_back(std::move(what)); }
  void Add(const Findings& more);

  const std::vector<LeftOut>& left_out() const { return left_out_; }
  const std::vector<std::string>& doubts() const { return doubts_; }
  /// One of the reasons was trouble on the way to the device, or somebody else who uses it: it is worth another look.
  bool may_pass() const;
  /// What was found of one part; nullptr: nothing.
  const LeftOut* Of(std::string_view part) const;
  /// Of a device of which nothing can be used: lists the reasons. Its code is that of a reason that may pass, where
  /// there is one, else Unsupported. `device` begins the message.
  Error NothingLeft(const std::string& device) const;

 private:
  std::vector<LeftOut> left_out_;
  std::vector<std::string> doubts_;
};

/// Whether an error that came while one part was looked at concerns the whole device: it is gone, or the call was
/// interrupted. After any other error the rest of the device may be as it should.
inline bool ConcernsAll(const Error& error) {
  return error.code == Code::Disconnected || error.code == Code::Cancelled || error.code == Code::WrongDevice;
}

/// An open device. Either part may be absent, not both. Destroying it closes the handle.
struct Device {
  std::unique_ptr<Lens> lens;
  std::unique_ptr<Camera> camera;
  std::optional<NominalOptics> optics;       ///< only from drivers that know (the simulated one)
  std::shared_ptr<Simulation> simulation{};  ///< null: real hardware
  Findings findings{};                       ///< parts that were left out, and why
};

/// A lens of which every axis was left out, so that its camera can still be served: it has no axes.
std::unique_ptr<Lens> LensWithoutAxes(Capabilities who, const Clock& clock);

/// Opens a device from the table of its [[lens]] or [lens.camera] section. Every key must be known.
using OpenFunction = Result<Device> (*)(const Settings& settings, const Clock& clock);

/// Something plugged in that a driver would take.
struct FoundDevice {
  std::string model;   ///< as the device names itself, for people
  std::string serial;  ///< empty where it has none
  std::string node;    ///< "/dev/hidraw0", "10.0.0.7:502"; empty where it has none
  std::string config;  ///< the keys that select it, as lines of TOML for its [[lens]] or [lens.camera]: `serial = "A1"`
  bool lens = false;   ///< offers a lens
  bool camera = false;  ///< offers a camera
  std::string problem;  ///< empty, or why it could not be opened now and what to do ("no permission to ...")
};

/// Lists what is plugged in. Disturbs nothing that is in use, moves nothing, and ends within 3 s, or 5 s on a network.
using ProbeFunction = Result<std::vector<FoundDevice>> (*)();

/// Settings that ship with a driver and that its users refer to by name, or replace by a file of their own.
struct Profiles {
  std::string_view (*text)(std::string_view name);  ///< TOML; empty: none of that name
  std::string_view (*names)();                      ///< "this, that": for messages
};

/// One row of the table of drivers (daemon/config/drivers_table.cpp).
struct Driver {
  std::string_view name;
  OpenFunction open;
  ProbeFunction probe = nullptr;  ///< nullptr: its devices cannot be searched for
  /// Whether settings make sense, as far as can be told without the device (BadData); nullptr: open() tells.
  Result<void> (*check)(const Settings& settings) = nullptr;
  bool simulated = false;  ///< its devices bring a Simulation
  bool reopen = true;      ///< a device that vanished is closed and opened anew; false: the same object finds it again
  /// Whether a [[bus]] of this driver makes sense (BadData); nullptr: it has no buses.
  Result<void> (*check_bus)(const Settings& bus) = nullptr;
  const Profiles* profiles = nullptr;  ///< what `profile` means in its settings; nullptr: nothing
};

}  // namespace lensd::drivers
