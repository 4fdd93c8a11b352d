// Finding cameras and opening them. Aravis holds one lock while it searches and while it opens by name, so that a
// camera that is not there would hold up those that are: here an address is asked first, and all searches are one.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config.h"
#include "gobject_handles.h"

namespace lensd::drivers::aravis {

/// A camera as a search shows it.
struct ListedCamera {
  std::string id;           ///< Aravis' own, "Vendor-Model-Serial"
  std::string physical_id;  ///< its MAC address, or its GUID
  std::string protocol;     ///< "GigEVision" or "USB3Vision"
  std::string address;      ///< of its network, or its bus
  std::string vendor, model, serial;
};

/// While it lives, nobody else in this process opens the camera at that address: who opens one controls it, and a
/// second opening would blame another program for that.
class CameraTurn {
 public:
  /// Waits until the others have done, 3 s at most.
  explicit CameraTurn(std::string address);
  ~CameraTurn();
  CameraTurn(const CameraTurn&) = delete;
  CameraTurn& operator=(const CameraTurn&) = delete;

 private:
  const std::string address_;
};

/// While it lives, this process has that camera connected. A search that opened it a second time would take seconds: no
/// camera obeys two.
class CameraInUse {
 public:
  /// `place`: OpenedCamera::place. `lens`: the camera moves a lens.
  CameraInUse(std::string place, bool lens);
  ~CameraInUse();
  CameraInUse(const CameraInUse&) = delete;
  CameraInUse& operator=(const CameraInUse&) = delete;

 private:
  const std::string place_;
};

/// Whether that camera moves a lens, where this process has it connected; nothing: it has not. Waits for an opening
/// that is under way, 3 s at most. From any thread.
std::optional<bool> LensOfCameraInUse(const ListedCamera& listed);

/// A camera that was opened, and the address it is at; empty: it is not on a network.
struct OpenedCamera {
  std::unique_ptr<CameraTurn> turn;  ///< null: it is not on a network. Give it up once nothing hangs on being alone
  Handle<ArvCamera> camera;
  std::string address;
  std::string place;  ///< of no other camera: its address, or its id where it has none
};

/// Every camera on the networks and on USB. Takes a second; who asks while a search goes on shares its result. From any
/// thread. Timeout: Aravis does not come back.
Result<std::vector<ListedCamera>> SearchCameras();

/// Opens a camera of that list. Errors as OpenCamera().
Result<OpenedCamera> OpenListed(const ListedCamera& listed);

/// Finds the configured camera and opens it. From any thread. Disconnected: it is not there, and why as far as is
/// known. Protocol, Timeout, Busy.
Result<OpenedCamera> OpenConfigured(const DriverConfig& config);

}  // namespace lensd::drivers::aravis
