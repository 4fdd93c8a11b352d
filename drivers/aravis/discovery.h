// Whether a GigE Vision camera is at an address, asked with discovery packets of our own. Aravis asks too when it opens
// a camera, but holds a lock of the whole process while no camera answers.
#pragma once

#include <string>
#include <vector>

#include "base/clock.h"
#include "base/result.h"

namespace lensd::drivers::aravis {

/// Who has an address, as far as its answers say.
enum class Presence { Silent, Camera, Stranger, Refuses, Unreachable };

/// Asks one address. Nothing here waits longer than it is told. One thread at a time.
class Hail {
 public:
  /// `address`: IPv4, in numbers.
  explicit Hail(const std::string& address);
  ~Hail();
  Hail(const Hail&) = delete;
  Hail& operator=(const Hail&) = delete;

  /// One more packet.
  void Send();
  /// What has been answered so far. Waits until a camera answers or none can, at most for `limit`.
  Presence Wait(Duration limit);
  /// This machine's own address on the way there; empty: there is no way.
  std::string here() const;
  /// Why it cannot be reached, for people.
  std::string why() const;

 private:
  void Fails(int error);

  int socket_ = -1;
  int error_ = 0;  ///< of the network
  Presence presence_ = Presence::Silent;
};

/// Both ends of the way to a camera: IPv4, in numbers.
struct Route {
  std::string camera, here;
};

/// Where the camera at `host` (a name or an address) is. Takes a second at most, and what the machine needs to look the
/// name up. From any thread. Disconnected: no device is there, and why as far as is known. Protocol: not a camera.
Result<Route> AskCamera(const std::string& host);

/// Where the camera at the end of `route` says that its GenICam file is: "Local:camera.xml;8000;1a2b", and perhaps
/// another place. Takes a second at most. From any thread. Disconnected: no answer. Unsupported: a file of more than 16
/// MiB: Aravis takes the size that the camera states, ends the process where there is not as much memory, and fetches
/// for hours where there is.
Result<std::vector<std::string>> AskForFile(const Route& route);

/// Whether a file at that place is a zip file.
bool IsPacked(const std::string& place);

/// The bytes of the file at such a place in the camera. Takes a millisecond for 512 bytes, 10 s at most. From any
/// thread. Disconnected: the camera does not send them. Timeout.
Result<std::string> FetchFile(const Route& route, const std::string& place);

}  // namespace lensd::drivers::aravis
